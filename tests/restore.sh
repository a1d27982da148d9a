#!/usr/bin/env bash
# Practises the restore of a store that is lost: backs up a store with a registered family, destroys
# it, restores the backup into an empty one, and compares frames byte by byte: a data directory,
# PostgreSQL with S3, and from each into the other. Prints the times.
#   tests/restore.sh
# Needs the programs of build/release. Exits 1 if a step fails or frames differ.
set -euo pipefail
usage() { sed -n '2,/^set -/s/^# \{0,1\}//p' "$0"; }
case ${1:-} in
  --help) usage; exit 0 ;;
  '') ;;
  *) echo "restore.sh: unknown argument: $1" >&2; usage >&2; exit 2 ;;
esac
cd "$(dirname "$0")/.."

bin=$PWD/build/release/bin
work=$(mktemp -d)
chmod 755 "$work"
. tests/servers.sh
destroy_stores() {
  stop_shared_stores
  rm -rf "$work/postgres" "$work/ceph" "$work/cache" "$work/data"
}
clean_up() {
  stop_server
  destroy_stores
  rm -rf "$work"
}
trap clean_up EXIT

fail() {
  echo "restore.sh: $1" >&2
  exit 1
}

# Sets $store to an empty data directory.
make_directory() { store=(--data "$work/data"); }

# Sets $store to an empty database and an empty bucket.
make_shared() {
  start_shared_stores
  store+=(--cache "$work/cache")
}

serve() {
  start_server "$bin/liquidblend-server" "${store[@]}"
  export LIQUIDBLEND_SERVER=$server
}

# frames_into DIRECTORY: two Draco frames, as the server sends them.
frames_into() {
  serve
  mkdir "$1"
  local weight
  for weight in 0 0.5; do
    "$bin/liquidblend" --quiet frame two_drops --weights $weight --time 0.8 \
      -o "$1/$weight.drc" >/dev/null
  done
  "$bin/liquidblend" list >"$1/list"
  stop_server
}

# Runs a command and prints how long it took: timed WHAT COMMAND...
timed() {
  local begin=$EPOCHREALTIME
  "${@:2}" >"$work/log" 2>&1 || { cat "$work/log" >&2; fail "$1 failed"; }
  printf '| %s | %s |\n' "$1" \
    "$(awk -v a="$begin" -v b="$EPOCHREALTIME" 'BEGIN { printf "%.1f", b - a }')"
}

# drill WHAT MAKE_FIRST MAKE_SECOND: the second store is made where the first one was destroyed.
drill() {
  "$2"
  serve
  "$bin/liquidblend" --quiet import a tests/data/two_drops/A >/dev/null
  "$bin/liquidblend" --quiet import b tests/data/two_drops/B >/dev/null
  "$bin/liquidblend" --quiet register two_drops --source a --target b --iterations 3 --wait >/dev/null
  stop_server
  frames_into "$work/before"
  timed "$1: back up" "$bin/liquidblend-admin" export "${store[@]}" "$work/backup"
  destroy_stores
  "$3"
  timed "$1: restore" "$bin/liquidblend-admin" import "${store[@]}" "$work/backup"
  timed "$1: check" "$bin/liquidblend-admin" check "${store[@]}"
  frames_into "$work/after"
  diff -r "$work/before" "$work/after" || fail "$1: frames or lists differ"
  destroy_stores
  rm -rf "$work/before" "$work/after" "$work/backup"
}

printf '| step | s |\n| --- | --- |\n'
drill "data directory" make_directory make_directory
drill "PostgreSQL and S3" make_shared make_shared
drill "data directory to PostgreSQL and S3" make_directory make_shared
drill "PostgreSQL and S3 to data directory" make_shared make_directory
echo "frames have the same bytes as before"
