# What scripts with containers have in common: phases, failures, cleaning up.
# Sourced; wants the working directory to be the repository's.
export CONTAINERS_CONF=${CONTAINERS_CONF:-$PWD/tests/containers.conf}
project=lbtest$$
network=$project
scratch=$(mktemp -d)
phases=()  # "seconds<tab>what"
current_phase=
script=$(basename "$0")

phase() {
  current_phase=$1
  local begin=$SECONDS
  printf '== %s\n' "$1"
  "$2"
  phases+=("$((SECONDS - begin))	$1")
}

print_table() {
  echo
  echo "| phase | s |"
  echo "| --- | --- |"
  printf '%s\n' "${phases[@]}" | awk -F'\t' '{print "| " $2 " | " $1 " |"; sum += $1}
    END {print "| all | " sum " |"}'
}

cannot() {
  echo "$script: this host cannot run containers: $*" >&2
  trap - ERR
  exit 77
}

fail() {
  echo "$script: $current_phase: $*" >&2
  show_logs
  trap - ERR
  exit 1
}

show_failure() {
  echo "$script: $current_phase: failed at: $1" >&2
  show_logs
}

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
  [ ${#phases[@]} = 0 ] || print_table
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

# await SECONDS COMMAND...: until it succeeds
await() {
  local end=$((SECONDS + $1))
  shift
  until "$@" >"$scratch/await" 2>&1; do
    [ $SECONDS -lt $end ] || { cat "$scratch/await" >&2; fail "gave up waiting for: $*"; }
    sleep 0.3
  done
}

# Without podman's complaint that nobody runs health checks by the clock where systemd is not.
quietly() {
  "$@" 2>"$scratch/quiet" && return
  cat "$scratch/quiet" >&2
  return 1
}
