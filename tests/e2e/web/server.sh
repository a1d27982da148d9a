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
bin=${LIQUIDBLEND_BINARY_DIR:-${BUILD:-$root/build/release}/bin}
mkdir -p "$2"
directory=$(cd "$2" && pwd)
shift 2

# end_server: ends the server of the directory, if one runs.
end_server() {
  local pid
  pid=$(cat "$directory/server.pid" 2>/dev/null) || return 0
  rm -f "$directory/server.pid"
  grep -qa -e "$directory/store" "/proc/$pid/cmdline" 2>/dev/null || return 0  # gone, or not ours
  kill "$pid" 2>/dev/null || return 0
  for _ in $(seq 600); do  # a sanitizer looks for leaks at the end
    grep -qs '^State:[[:space:]]*[^Z]' "/proc/$pid/status" || return 0  # gone, or a zombie
    sleep 0.1
  done
  kill -9 "$pid" 2>/dev/null || true
}

# begin_server [ARGUMENT..]
begin_server() {
  setsid "$bin/liquidblend-server" --data "$directory/store" --listen 127.0.0.1:0 \
    --http 127.0.0.1:0 --workers 1 --verbose "$@" \
    </dev/null >"$directory/server.out" 2>"$directory/server.log" &
  local pid=$!
  echo "$pid" >"$directory/server.pid"
  until grep -q '^http on ' "$directory/server.out"; do
    kill -0 "$pid" 2>/dev/null || { cat "$directory/server.log" >&2; exit 1; }
    sleep 0.1
  done
  sed -n -e 's/^listening on /LIQUIDBLEND_SERVER=/p' -e 's|^http on |BASE_URL=http://|p' \
    "$directory/server.out" >"$directory/page.env"
}

start() {
  stop  # what an interrupted run has left
  mkdir -p "$directory"
  begin_server
  LIQUIDBLEND_SERVER=$(sed -n 's/^LIQUIDBLEND_SERVER=//p' "$directory/page.env")
  export LIQUIDBLEND_SERVER
  local input
  for input in A B; do
    "$bin/liquidblend" import "drops_${input,}" "$root/tests/data/two_drops/$input"
  done
  "$bin/liquidblend" register two_drops --source drops_a --target drops_b --iterations 4 --wait
}

restart() {
  end_server
  begin_server "$@"
}

stop() {
  end_server
  rm -rf "$directory"
}

"$command" "$@"
