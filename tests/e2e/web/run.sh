#!/usr/bin/env bash
# Runs the browser tests of the page, and those of exported files, against a server of their own,
# with two_drops registered.
# Those of tokens follow with a second server, if no test is named.
#   tests/e2e/web/run.sh [TEST..]     such as: play scrub; default all
# BUILD: the build folder (default build/release); LIQUIDBLEND_BINARY_DIR: other programs than its.
# LEAK_FRAMES: how many frames are shown to see whether memory grows (default 300).
# LIQUIDBLEND_E2E_PATIENCE=600: waits ten times as long, where programs are slow (default 60).
# STRICT_TIMES=1: figures of time count, too; for a machine that does nothing else.
# Exit: 0 if all passed; 1 if not; 2 usage.
set -euo pipefail
usage() { sed -n '2,/^set -/s/^# \{0,1\}//p' "$0"; }
refuse() { echo "run.sh: $1" >&2; usage >&2; exit 2; }
if [ "${1:-}" = --help ]; then usage; exit 0; fi
for test in "$@"; do
  [ -e "$(dirname "$0")/$test.test.mjs" ] || refuse "unknown test: $test"
done
here=$(cd "$(dirname "$0")" && pwd)
root=$(cd "$here/../../.." && pwd)
bin=${LIQUIDBLEND_BINARY_DIR:-${BUILD:-$root/build/release}/bin}
data=$(mktemp -d)

server=
stop() {
  [ -n "$server" ] || return 0
  kill "$server" 2>/dev/null || true
  wait "$server" 2>/dev/null || true
}
trap 'stop; rm -rf "$data"' EXIT

# start [ARGUMENT..]: a server of the store; sets LIQUIDBLEND_SERVER and BASE_URL.
start() {
  stop
  "$bin/liquidblend-server" --data "$data/store" --listen 127.0.0.1:0 --http 127.0.0.1:0 \
    --workers 1 --verbose "$@" >"$data/server.out" 2>"$data/server.log" &
  server=$!
  until grep -q '^http on ' "$data/server.out"; do
    kill -0 "$server" 2>/dev/null || { cat "$data/server.log" >&2; exit 1; }
    sleep 0.1
  done
  LIQUIDBLEND_SERVER=$(sed -n 's/^listening on //p' "$data/server.out")
  BASE_URL=http://$(sed -n 's/^http on //p' "$data/server.out")
  export LIQUIDBLEND_SERVER BASE_URL
}

export LEAK_FRAMES=${LEAK_FRAMES:-300}
export LIQUIDBLEND_CLI=$bin/liquidblend

start
for input in A B; do
  "$bin/liquidblend" import "drops_${input,}" "$root/tests/data/two_drops/$input" >/dev/null
done
"$bin/liquidblend" register two_drops --source drops_a --target drops_b --iterations 4 --wait \
  >/dev/null
cd "$here"
node run.mjs "$@"

# The same store behind a token, which must be in no line of the log.
[ $# = 0 ] || exit 0
"$bin/liquidblend-server" --make-token tester --scopes frames >"$data/tokens.json" 2>"$data/token"
TOKEN=$(head -n 1 "$data/token")
export TOKEN
start --tokens "$data/tokens.json"
node run.mjs token
encoded=$(printf %s "$TOKEN" | base64 | tr '+/' '-_' | tr -d '=')
if grep -F -e "$TOKEN" -e "$encoded" "$data/server.log"; then
  echo "run.sh: the server's log has the token" >&2
  exit 1
fi
