# Phases of a long script: their times, waiting, and failures that name the phase.
# Sourced; wants $scratch, a folder of the script's own, and a function show_logs.
phases=()  # "seconds<tab>what"
current_phase=
script=$(basename "$0")

# phase WHAT COMMAND...
phase() {
  current_phase=$1
  local begin=$SECONDS
  printf '== %s\n' "$1"
  "${@:2}"
  phases+=("$((SECONDS - begin))	$1")
}

print_table() {
  [ ${#phases[@]} -gt 0 ] || return 0
  echo
  echo "| phase | s |"
  echo "| --- | --- |"
  printf '%s\n' "${phases[@]}" | awk -F'\t' '{print "| " $2 " | " $1 " |"; sum += $1}
    END {print "| all | " sum " |"}'
}

# cannot WHY...: ends with 77
cannot() {
  echo "$script: this host cannot run it: $*" >&2
  trap - ERR
  exit 77
}

fail() {
  echo "$script: $current_phase: $*" >&2
  show_logs
  trap - ERR
  exit 1
}

# show_failure COMMAND: for a trap of ERR
show_failure() {
  echo "$script: $current_phase: failed at: $1" >&2
  show_logs
}

# await SECONDS COMMAND...: until it succeeds
await() {
  local end=$((SECONDS + $1))
  shift
  until "$@" >"$scratch/await" 2>&1; do
    [ $SECONDS -lt $end ] || { cat "$scratch/await" >&2; fail "gave up waiting for: $*"; }
    sleep 0.2
  done
}
