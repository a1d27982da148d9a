#!/usr/bin/env bash
# A server for the browser tests of the page, with two_drops registered.
#   tests/e2e/web/server.sh start DIRECTORY              DIRECTORY is emptied first
#   tests/e2e/web/server.sh restart DIRECTORY [ARGUMENT..]   the same store, with these arguments
#   tests/e2e/web/server.sh stop DIRECTORY               also after a start that failed
# DIRECTORY/page.env says where it is; its log is DIRECTORY/server.log.
# BUILD: the build folder (default build/release); LIQUIDBLEND_BINARY_DIR: other programs than its.
# Exit: 0, or 1 if the server does not start; 2 usage.
set -euo pipefail
usage() { sed -n '2,/^set -/s/^# \{0,1\}//p' "$0"; }
refuse() { echo "server.sh: $1" >&2; usage >&2; exit 2; }
command=${1:-}
case $command in
  --help) usage; exit 0 ;;
  start | stop) [ $# = 2 ] || refuse "$command wants one DIRECTORY" ;;
  restart) [ $# -ge 2 ] || refuse "$command wants a DIRECTORY" ;;
  *) refuse "unknown command: $command" ;;
esac
root=$(cd "$(dirname "$0")/../../.." && pwd)
bin=$(cd "${LIQUIDBLEND_BINARY_DIR:-${BUILD:-$root/build/release}/bin}" && pwd)
mkdir -p "$2"
work=$(cd "$2" && pwd)
shift 2
cd "$root"
. tests/servers.sh

# end_server: ends the server of the directory, if one runs.
end_server() {
  local pid
  pid=$(cat "$work/server.pid" 2>/dev/null) || return 0
  rm -f "$work/server.pid"
  grep -qa -e "$work/store" "/proc/$pid/cmdline" 2>/dev/null || return 0  # gone, or not ours
  kill "$pid" 2>/dev/null || return 0
  for _ in $(seq 600); do  # a sanitizer looks for leaks at the end
    grep -qs '^State:[[:space:]]*[^Z]' "/proc/$pid/status" || return 0  # gone, or a zombie
    sleep 0.1
  done
  kill -9 "$pid" 2>/dev/null || true
}

# begin_server [ARGUMENT..]
begin_server() {
  trap 'echo "$server_pid" >"$work/server.pid"' EXIT  # also of one that does not start in time
  start_server "$bin/liquidblend-server" --data "$work/store" --http 127.0.0.1:0 --verbose "$@"
  until grep -q '^http on ' "$work/server.out"; do
    kill -0 "$server_pid" 2>/dev/null || { cat "$work/server.log" >&2; exit 1; }
    sleep 0.1
  done
  export LIQUIDBLEND_SERVER=$server
  printf 'LIQUIDBLEND_SERVER=%s\nBASE_URL=http://%s\n' "$server" \
    "$(sed -n 's/^http on //p' "$work/server.out")" >"$work/page.env"
}

start() {
  stop  # what an interrupted run has left
  mkdir -p "$work"
  begin_server
  local input
  for input in A B; do
    "$bin/liquidblend" import "drops_${input,}" "tests/data/two_drops/$input"
  done
  "$bin/liquidblend" register two_drops --source drops_a --target drops_b --iterations 4 --wait
}

restart() {
  end_server
  begin_server "$@"
}

stop() {
  end_server
  rm -rf "$work"
}

"$command" "$@"
