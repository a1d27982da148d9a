# Containers of tests/packages.sh in which systemd runs, as on a machine. Sourced after common.sh.
base=${BASE:-localhost/liquidblend-base:12}
machine_image=localhost/liquidblend-machine:12
packages=$PWD/build/packages
machine=  # the container that is asked

# start_machine NAME: fresh, with the packages in /packages; sets `machine`
start_machine() {
  machine=$project-$1
  quietly podman run --detach --name "$machine" --hostname "$1" --label "$project" \
    --network "$network" --systemd=always --volume "$packages:/packages:ro" \
    --volume "$scratch:/scratch" "$machine_image" >/dev/null
  await 60 on systemctl --wait is-system-running
}

# on COMMAND...: as root on the machine
on() { podman exec "$machine" "$@"; }

# on_sh SCRIPT
on_sh() { podman exec "$machine" bash -euo pipefail -c "$1"; }

# apt ARGUMENTS...: apt-get without a question and without what is only recommended. The machine's
# shell reads the arguments.
apt() {
  on_sh "DEBIAN_FRONTEND=noninteractive apt-get -q -y --no-install-recommends \
    -o Dpkg::Options::=--force-confdef -o Dpkg::Options::=--force-confold $*" >"$scratch/apt.out" 2>&1 ||
    { tail -40 "$scratch/apt.out" >&2; fail "apt-get $*"; }
}

is_serving() { on sh -c 'systemctl is-active liquidblend-server && liquidblend-server --check'; }

# expect WANTED GOT WHAT
expect() { [ "$1" = "$2" ] || fail "$3: \"$2\" instead of \"$1\""; }

# What systemd and the server have said, instead of a console.
show_logs() {
  local name
  for name in $(podman ps --filter "label=$project" --format '{{.Names}}'); do
    echo "---- $name" >&2
    podman exec "$name" journalctl --no-pager -n 30 >&2 2>/dev/null || podman logs --tail 15 "$name" >&2
  done
}
