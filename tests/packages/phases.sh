# What tests/packages.sh does, a function a phase. Sourced after machine.sh.
limit_s=180  # from nothing to a frame
old_version=0.0.9-1

check_host() {
  command -v podman >/dev/null || cannot "there is no podman; deploy/install-deps.sh --containers"
  [ "$(id -u)" = 0 ] || cannot "root is needed"
  podman image exists "$base" || deploy/images/make-base.sh "$base" ||
    cannot "no base image: mmdebstrap failed"
  podman network create "$network" >/dev/null || cannot "no network: podman network create failed"
  local said
  said=$(podman run --rm --network "$network" "$base" echo fine 2>&1) && [ "${said##*$'\n'}" = fine ] ||
    cannot "podman run failed: $said"
}

check_packages() {
  [ $built = 1 ] || deploy/packages/build.sh --no-install >"$scratch/build.out" ||
    { cat "$scratch/build.out" >&2; fail "build.sh"; }
  ls "$packages"/*.deb >/dev/null || fail "no packages; run without --built"
  (cd "$packages" && sha256sum --check --quiet SHA256SUMS)
  tests/deploy/packages/check_debs.py "$packages"
}

make_machine_image() {
  podman build --quiet --format docker --network host --tag "$machine_image" --file - . >/dev/null <<IMAGE
FROM $base
RUN apt-get update -q && apt-get install -q -y --no-install-recommends procps systemd-sysv && \
    rm -rf /var/lib/apt/lists/*
STOPSIGNAL SIGRTMIN+3
CMD ["/sbin/init"]
IMAGE
}

# The commands of docs/operations/installing.md.
install_and_play() {
  start_machine fresh
  ! on sh -c 'command -v cc gcc g++ clang tcc cmake make' || fail "a compiler is there"
  local begin=$SECONDS
  apt update
  on_sh 'cp /packages/liquidblend-*.deb /root'
  apt --install-recommends install '/root/liquidblend-*.deb'
  local installed=$((SECONDS - begin))
  await 30 is_serving
  on_sh 'cd /usr/share/liquidblend/examples/two_drops
    liquidblend import drops_a A
    liquidblend import drops_b B
    liquidblend register two_drops --source drops_a --target drops_b --wait
    liquidblend frame two_drops --weights 0.5 --time 0.8 -o /scratch/frame.ply' >"$scratch/play" ||
    { cat "$scratch/play" >&2; fail "the bundled pair"; }
  local all=$((SECONDS - begin))
  on liquidblend inspect /scratch/frame.ply >"$scratch/inspect"
  grep -q 'closed' "$scratch/inspect" || { cat "$scratch/inspect" >&2; fail "the frame is not closed"; }
  tests/packages/check_ply.py "$scratch/frame.ply"
  echo "installed after $installed s, a frame after $all s, of $limit_s"
  [ $all -lt $limit_s ] || fail "it took $all s"
}

check_machine() {
  ! on sh -c 'command -v cc gcc g++ clang tcc cmake make' || fail "a compiler was installed"
  expect enabled "$(on systemctl is-enabled liquidblend-server)" "server at boot"
  expect "750 root liquidblend" "$(on stat -c '%a %U %G' /etc/liquidblend)" /etc/liquidblend
  expect "640 root root" "$(on stat -c '%a %U %G' /etc/liquidblend/server.env)" server.env
  expect "750 liquidblend liquidblend" "$(on stat -c '%a %U %G' /var/lib/liquidblend)" "the data"
  local port address
  address=$(podman inspect --format "{{(index .NetworkSettings.Networks \"$network\").IPAddress}}" "$machine")
  for port in 50051 8080; do
    on_sh "exec 3<>/dev/tcp/127.0.0.1/$port"
    ! podman run --rm --label "$project" --network "$network" "$base" \
      bash -c "exec 3<>/dev/tcp/$address/$port" 2>/dev/null || fail "others reach port $port"
  done
  expect liquidblend "$(on_sh 'stat -c %U /proc/$(systemctl show -P MainPID liquidblend-server)')" \
    "the server's user"
  expect "" "$(on_sh "journalctl -u liquidblend-server -o cat | grep -v '^{' |
    grep -v -E '^(Starting|Started) |^(listening|http) on ' || true")" "lines of the log that are not JSON"
}

start_workers() {
  on systemctl start liquidblend-worker@1 liquidblend-worker@2
  await 30 on_sh 'liquidblend-admin workers --data /var/lib/liquidblend | grep " at work, 4 idle"'
  expect "active active" "$(on systemctl is-active liquidblend-worker@1 liquidblend-worker@2 | xargs)" \
    "liquidblend-worker@1 and @2"
}

use_python() {
  apt install /packages/libliquidblend1_*.deb /packages/python3-liquidblend_*.deb
  on python3 -c '
import importlib.metadata
import liquidblend
assert importlib.metadata.version("liquidblend") == liquidblend.library_version()
frame = liquidblend.connect().frame("two_drops", weights=0.5, time=0.8)
print(frame.positions.shape[0])' >"$scratch/python"
  [ "$(cat "$scratch/python")" -gt 1000 ] || fail "a frame in Python: $(cat "$scratch/python")"
  on_sh 'ls /usr/lib/python3/dist-packages/liquidblend/__pycache__/*.pyc' >/dev/null
}

build_program() {
  local of_fresh=$machine
  start_machine programs
  apt update
  apt install g++ cmake make /packages/libliquidblend1_*.deb /packages/libliquidblend-dev_*.deb
  podman cp tests/client/install/consumer "$machine:/root/consumer"
  on_sh 'cd /root
    cmake -S consumer -B build -DCMAKE_BUILD_TYPE=Release
    cmake --build build
    build/consumer
    g++ -std=c++17 consumer/c_api.cc -lliquidblend -o c_api
    ./c_api' >"$scratch/program" 2>&1 || { tail -30 "$scratch/program" >&2; fail "the program"; }
  quietly podman rm --force --time 0 "$machine" >/dev/null
  machine=$of_fresh
}

# The answer that must stay the same.
frame_sum() { on_sh 'liquidblend -q frame two_drops -w 0.5 -t 0.8 -o /tmp/f.drc >/dev/null; sha256sum </tmp/f.drc'; }

reinstall() {
  on_sh 'echo LIQUIDBLEND_WORKERS=1 >>/etc/liquidblend/server.env'
  local before
  before=$(frame_sum)
  apt install --reinstall /root/liquidblend-server_*.deb
  await 30 is_serving
  on grep -qx LIQUIDBLEND_WORKERS=1 /etc/liquidblend/server.env || fail "server.env was replaced"
  expect "$before" "$(frame_sum)" "frame after a reinstallation"
  await 30 on_sh '[ "$(pgrep -c -P "$(systemctl show -P MainPID liquidblend-server)" liquidblend)" = 1 ]'
}

# age PACKAGE..: the same with another version and other samples of configuration, in /scratch
age() {
  local name tree=$scratch/tree new
  new=$(dpkg-deb --field "$packages"/liquidblend-server_*.deb Version)
  for name in "$@"; do
    dpkg-deb --raw-extract "$packages/$name"_*.deb "$tree"
    sed -i "s/$new/$old_version/" "$tree/DEBIAN/control"
    if ls "$tree"/etc/liquidblend/*.env >/dev/null 2>&1; then
      sed -i '1s/^/# Of an older version.\n/' "$tree"/etc/liquidblend/*.env
    fi
    dpkg-deb --root-owner-group -Znone --build "$tree" "$scratch/$name.deb" >/dev/null
    rm -r "$tree"
  done
}

upgrade() {
  age liquidblend-server liquidblend-worker liquidblend-client
  local of_fresh=$machine
  start_machine old
  apt update
  apt install /scratch/liquidblend-{server,worker,client}.deb
  await 30 is_serving
  expect "$old_version" "$(on dpkg-query -W -f '${Version}' liquidblend-server)" "older version"
  podman cp tests/data/dam_break_clip/w0_p0 "$machine:/root/clip"
  on liquidblend -q import clip /root/clip >/dev/null
  on systemctl start liquidblend-worker@1
  on_sh 'echo LIQUIDBLEND_WORKERS=1 >>/etc/liquidblend/server.env'
  local server worker
  server=$(on systemctl show -P MainPID liquidblend-server)
  worker=$(on systemctl show -P MainPID liquidblend-worker@1)
  on_sh 'cp /packages/liquidblend-{server,worker,client}_*.deb /root'
  apt install '/root/liquidblend-*.deb'
  await 30 is_serving
  on liquidblend inspect animations/clip >/dev/null || fail "the animation is lost"
  on grep -qx LIQUIDBLEND_WORKERS=1 /etc/liquidblend/server.env || fail "server.env was replaced"
  on test -e /etc/liquidblend/server.env.dpkg-dist || fail "the newer server.env is not beside it"
  ! on grep -q 'older version' /etc/liquidblend/worker.env || fail "worker.env is not the newer one"
  [ "$(on systemctl show -P MainPID liquidblend-server)" != "$server" ] || fail "the old server runs"
  [ "$(on systemctl show -P MainPID liquidblend-worker@1)" != "$worker" ] || fail "the old worker runs"
  # What was disabled stays so.
  on systemctl disable --now liquidblend-server >/dev/null 2>&1
  apt install --reinstall /root/liquidblend-server_*.deb
  expect "disabled inactive" "$(on_sh 'systemctl is-enabled liquidblend-server || true
    systemctl is-active liquidblend-server || true' | xargs)" "a server that was disabled"
  quietly podman rm --force --time 0 "$machine" >/dev/null
  machine=$of_fresh
}

remove_and_purge() {
  local before
  before=$(frame_sum)
  apt remove liquidblend-server liquidblend-worker
  ! on pgrep -u liquidblend || fail "programs run on"
  on test -e /var/lib/liquidblend/catalog.sqlite || fail "removing lost the data"
  on grep -qx LIQUIDBLEND_WORKERS=1 /etc/liquidblend/server.env || fail "removing lost server.env"
  apt install /root/liquidblend-server_*.deb /root/liquidblend-worker_*.deb
  await 30 is_serving
  expect "$before" "$(frame_sum)" "frame after removal and installation"
  on_sh 'echo secret >/etc/liquidblend/tokens.json'
  apt purge "'liquidblend-*'" libliquidblend1 python3-liquidblend
  ! on pgrep -u liquidblend || fail "programs run on"
  expect /etc/liquidblend/tokens.json "$(on_sh 'find / -xdev \( -path /proc -o -path /scratch -o \
    -path /packages -o -path /root -o -path /var/log -o -path /tmp \) -prune -o -iname "*liquidblend*" ! -type d \
    -print -o -path "/etc/liquidblend/*" -print' | sort | xargs)" "files that are left"
  ! on test -e /var/lib/liquidblend || fail "purging left the data"
}
