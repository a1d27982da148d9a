# What tests/containers.sh does, a function a phase; tests/kubernetes.sh begins with the same ones.
# Sourced after stack.sh.
operations=()  # all registrations that were accepted
version=0      # of the family drops
expected=      # its frames

check_host() {
  command -v podman >/dev/null || cannot "there is no podman; deploy/install-deps.sh --containers"
  [ "$(id -u)" = 0 ] || cannot "root is needed (networks that containers are cut off from)"
  if [ -z "${BASE:-}" ]; then
    BASE=localhost/liquidblend-base:12
    podman image exists "$BASE" || deploy/images/make-base.sh "$BASE" ||
      cannot "no base image: mmdebstrap failed"
  fi
  make_network || cannot "no network: podman network create failed"
  local said
  said=$(podman run --rm --network "$network" "$BASE" echo fine 2>&1) && [ "${said##*$'\n'}" = fine ] ||
    cannot "podman run failed: $said"
}

# The same programs in an image of their own (by --label alone, podman 4.3 takes the cached one).
build_next() {  # TARGET
  printf 'FROM %s\nLABEL org.opencontainers.image.version=next\n' "$(image "$1")" |
    podman build --quiet --format docker --tag "$(image "$1" next)" --file - . >/dev/null
}

# All that its programs link is in it.
check_libraries() {  # TARGET
  podman run --rm --no-healthcheck --label "$project" --network none --entrypoint sh \
    "$(image "$1")" -c '
    find /usr/local/bin /opt -type f \( -perm -100 -o -name "*.so" \) ! -name "*.sh" ! -name "*.py" -exec ldd {} +
    ' >"$scratch/libraries"
  grep -q "libtbb.so" "$scratch/libraries" || fail "$1: no program is linked"
  ! grep "not found" "$scratch/libraries" || fail "$1: libraries are missing"
}

# The labels of deploy/images/build.sh, and its list of what the image holds.
check_image() {  # TARGET
  local label wanted
  for label in version revision created title; do
    wanted=$(podman inspect --format "{{index .Config.Labels \"org.opencontainers.image.$label\"}}" \
      "$(image "$1")")
    [ -n "$wanted" ] || fail "$1 has no label $label"
  done
  tests/deploy/packages/check_spdx.py "build/images/liquidblend-$1.spdx.json"
  local packages
  packages=$(podman run --rm --no-healthcheck --label "$project" --network none \
    --entrypoint dpkg-query "$(image "$1")" -W -f '.\n' | wc -l)
  [ "$(grep -c pkg:deb/debian/ "build/images/liquidblend-$1.spdx.json")" = "$packages" ] ||
    fail "$1: the list has not the $packages packages of the image"
}

build_targets() {  # TARGET...
  local arguments=(--tag test)
  [ "$prebuilt" = 0 ] || arguments+=(--prebuilt)
  BASE=$BASE deploy/images/build.sh "${arguments[@]}" "$@"
}

build_images() {
  local target
  build_targets server worker client e2e postgres s3
  for target in server worker; do build_next $target; done
  for target in server worker client e2e; do
    check_libraries $target
    check_image $target
  done
}

start_stack() {
  install -m 600 /dev/null "$scratch/service.env"
  cat >"$scratch/service.env" <<ENV
POSTGRES_USER=liquidblend
POSTGRES_PASSWORD=$(od -An -N16 -tx1 /dev/urandom | tr -d ' \n')
AWS_ACCESS_KEY_ID=liquidblendkey
AWS_SECRET_ACCESS_KEY=$(od -An -N16 -tx1 /dev/urandom | tr -d ' \n')
AWS_ENDPOINT_URL=http://s3:7480
LIQUIDBLEND_BLOBS=s3://liquidblend/store
LIQUIDBLEND_CACHE=/var/lib/liquidblend/cache
LIQUIDBLEND_SERVER=$(both_servers)
ENV
  local password
  password=$(sed -n 's/^POSTGRES_PASSWORD=//p' "$scratch/service.env")
  echo "LIQUIDBLEND_STORE=postgresql://liquidblend:$password@postgres:5432/liquidblend" \
    >>"$scratch/service.env"
  run postgres "$(image postgres)" --memory 1g
  run s3 "$(image s3)" --memory 3g --env S3_BYTES=2147483648
  await 60 is_healthy postgres
  await 120 podman exec "$project-s3" test -f /var/lib/ceph/one/ready
  local k
  for k in 1 2; do
    start_server server$k "$(image server)"
    start_worker worker$k "$(image worker)"
  done
  run client "$(image client)" "${scene[@]}" --entrypoint sleep -- infinity
  run tests "$(image e2e)" -- sleep infinity
  for k in 1 2; do
    await 60 is_healthy server$k
    await 60 is_healthy worker$k
  done
}

run_e2e() { tests env "LIQUIDBLEND_E2E_SERVERS=$(both_servers)" suite.sh running; }

# Tests that start their programs and stores themselves, all in one container.
run_suite() {  # SUITE [podman's options]
  local suite=$1
  shift
  podman run --rm --init --no-healthcheck --name "$project-suite" "${confined[@]}" --memory 4g \
    --pids-limit 1024 "$@" "$(image e2e)" suite.sh "$suite" || fail "not all tests pass"
}

run_embedded_suite() { run_suite embedded --network none; }

run_faults_suite() { run_suite faults --network none; }

# With a PostgreSQL of their own, and the S3 of the stack.
run_shared_suite() {
  grep '^AWS_' "$scratch/service.env" >"$scratch/suite.env"
  run_suite shared $(on_network suite) --env-file "$scratch/suite.env"
}

submit() {  # starts a registration of drops; sets `operation`
  operation=$(liquidblend --json register drops --replace --source drops_a --target drops_b \
    --spacing 2 --levels 0 --iterations 24 | python3 -c '
import json, sys
print(json.load(sys.stdin)["name"])')
  operations+=("$operation")
}

is_iterating() { [ "$(field "$1" '["progress"]["iteration"]')" -gt 1 ]; }

# submit, until a worker iterates; sets `worker` to its container's name
submit_and_await_work() {
  submit
  await 120 is_iterating "$operation"
  worker=$(field "$operation" '["progress"]["worker"]')
  worker=${worker%%:*}
}

# It is done, made the next version and no other, and the frames are what they were.
check_done() {
  liquidblend operations "$operation" --wait >/dev/null
  [ "$(field "$operation" '["state"]')" = done ] || fail "$operation did not succeed"
  local published
  published=$(field "$operation" '["family"]["version"]')
  [ "$published" = $((version + 1)) ] || fail "version $published instead of $((version + 1))"
  version=$published
  local server
  for server in server1 server2; do
    [ "$(frames_of drops $server)" = "$expected" ] || fail "$server has other frames"
  done
}

make_scene() {
  liquidblend import drops_a /data/two_drops/A >/dev/null
  liquidblend import drops_b /data/two_drops/B >/dev/null
  submit
  liquidblend operations "$operation" --wait >/dev/null
  version=$(field "$operation" '["family"]["version"]')
  expected=$(frames_of drops server1)
  [ "$(frames_of drops server2)" = "$expected" ] || fail "the servers' frames differ"
  # The one format that needs more than the program.
  liquidblend export drops -w 0.5 --fps 2 --format vdb -o /tmp/vdb >/dev/null
  client test -s /tmp/vdb/frame_0001.vdb || fail "no frame was exported as OpenVDB"
}

kill_worker() {
  submit_and_await_work
  podman kill --signal KILL "$project-$worker" >/dev/null
  check_done
  [ "$(field "$operation" '["progress"]["attempt"]')" -gt 1 ] || fail "$worker had not been at it"
  quietly podman start "$project-$worker" >/dev/null
  await 60 is_healthy "$worker"
}

start_steady_client() {
  run steady "$(image e2e)" -- steady_client "$(both_servers)" drops
  await 30 sh -c "podman logs $project-steady 2>&1 | grep -q ^asking"
}

stop_steady_client() {
  quietly podman stop --time 60 "$project-steady" >/dev/null
  podman logs "$project-steady" 2>&1 | tail -n +2
  [ "$(podman wait "$project-steady")" = 0 ] || fail "requests failed, or frames differed"
  quietly podman rm --volumes "$project-steady" >/dev/null
}

kill_server() {
  start_steady_client
  submit_and_await_work
  liquidblend import drops_c /data/two_drops/A >"$scratch/import" 2>&1 &
  local import=$!
  sleep 0.4  # in the middle of 6 MB
  podman kill --signal KILL "$project-server1" >/dev/null
  wait $import || { cat "$scratch/import" >&2; fail "the import was lost"; }
  sleep 2
  quietly podman start "$project-server1" >/dev/null
  await 60 is_healthy server1
  stop_steady_client
  check_done
}

kill_postgres() {
  submit_and_await_work
  podman kill --signal KILL "$project-postgres" >/dev/null
  sleep 2
  quietly podman start "$project-postgres" >/dev/null
  await 60 is_healthy postgres
  await 60 frames_of drops server1
  await 60 frames_of drops server2
  check_done
}

has_gone_on() { [ "$(field "$operation" '["progress"]["worker"]')" != "$1" ]; }

# For longer than its lease; it is back before the other one has finished, with a stale lease.
cut_off_worker() {
  submit_and_await_work
  local name
  name=$(field "$operation" '["progress"]["worker"]')
  podman network disconnect "$network" "$project-$worker"
  sleep $((lease_s + 1))
  await 60 has_gone_on "$name"
  podman network connect --ip "$(address_of "$worker")" "$network" "$project-$worker"
  check_done
  [ "$(podman inspect --format '{{.State.Running}}' "$project-$worker")" = true ] ||
    fail "$worker ended"
  await 60 is_healthy "$worker"
}

roll() {
  start_steady_client
  submit_and_await_work
  liquidblend import drops_d /data/two_drops/B >"$scratch/import" 2>&1 &
  local import=$! name
  for name in server1 server2; do replace server $name "$(image server next)"; done
  for name in worker1 worker2; do replace worker $name "$(image worker next)"; done
  wait $import || { cat "$scratch/import" >&2; fail "the import failed"; }
  check_done
  stop_steady_client
  for name in server1 server2 worker1 worker2; do
    [ "$(podman inspect --format '{{index .Config.Labels "org.opencontainers.image.version"}}' \
      "$project-$name")" = next ] || fail "$name is of the old image"
  done
}

read_metrics() {
  local server name
  for server in server1 server2; do
    tests curl -sf "http://$server:8080/metrics" >"$scratch/metrics"
    for name in liquidblend_frames_total 'liquidblend_jobs{state="succeeded"}' \
      liquidblend_requests_total process_resident_memory_bytes; do
      grep -qF "$name" "$scratch/metrics" || fail "$server has no metric $name"
    done
    echo "$server: $(awk '/^liquidblend_frames_total/ {n += $NF} END {print n}' \
      "$scratch/metrics") frames since its start"
  done
}

check_nothing_lost() {
  local name
  for name in "${operations[@]}"; do
    [ "$(field "$name" '["state"]')" = done ] || fail "$name is not done"
  done
  for name in drops_a drops_b drops_c drops_d; do
    liquidblend inspect "animations/$name" >/dev/null
  done
  echo "${#operations[@]} registrations and 4 imports accepted, all done; drops is at version $version"
}

check_units() {
  deploy/systemd/verify.sh
}
