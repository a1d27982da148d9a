# Containers of a script: logs, cleaning up, waiting.
# Sourced; wants the working directory to be the repository's.
export CONTAINERS_CONF=${CONTAINERS_CONF:-$PWD/tests/containers.conf}
project=lbtest$$
network=$project
scratch=$(mktemp -d)
. tests/phases.sh

own_containers() { podman ps -a --filter "label=$project" --format '{{.Names}}'; }

show_logs() {
  local name
  for name in $(own_containers); do
    echo "---- $name" >&2
    podman logs --tail 15 "$name" >&2 2>&1 || true
  done
}

clean_up() {
  local status=$?
  trap - ERR EXIT
  trap '' INT TERM
  set +e
  print_table
  {
    [ -z "$(type -t compose_down)" ] || compose_down
    [ -z "$(type -t kube_down)" ] || kube_down
    podman ps -aq --filter "label=$project" | xargs -r podman rm --force --volumes --time 0
    podman network exists "$network" && podman network rm --force "$network"
    podman volume ls -q --filter "name=$project" | xargs -r podman volume rm --force
  } >/dev/null 2>&1
  rm -rf "$scratch"
  exit $status
}

# Without podman's complaint that nobody runs health checks by the clock where systemd is not.
quietly() {
  "$@" 2>"$scratch/quiet" && return
  cat "$scratch/quiet" >&2
  return 1
}
