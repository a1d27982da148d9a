#!/usr/bin/env bash
# Runs the browser tests of the page against a server of their own, with two_drops registered.
#   tests/e2e/web/run.sh [TEST..]     such as: play scrub; default all
# BUILD: the build folder (default build/release); LIQUIDBLEND_BINARY_DIR: other programs than its.
# LEAK_FRAMES: how many frames are shown to see whether memory grows (default 300).
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

"$bin/liquidblend-server" --data "$data/store" --listen 127.0.0.1:0 --http 127.0.0.1:0 \
  --workers 1 >"$data/server.out" 2>"$data/server.log" &
server=$!
stop() {
  kill "$server" 2>/dev/null || true
  wait "$server" 2>/dev/null || true
  rm -rf "$data"
}
trap stop EXIT
until grep -q '^http on ' "$data/server.out"; do
  kill -0 "$server" 2>/dev/null || { cat "$data/server.log" >&2; exit 1; }
  sleep 0.1
done
LIQUIDBLEND_SERVER=$(sed -n 's/^listening on //p' "$data/server.out")
BASE_URL=http://$(sed -n 's/^http on //p' "$data/server.out")
export LEAK_FRAMES=${LEAK_FRAMES:-300}
export LIQUIDBLEND_SERVER BASE_URL LIQUIDBLEND_CLI=$bin/liquidblend

for input in A B; do
  "$bin/liquidblend" import "drops_${input,}" "$root/tests/data/two_drops/$input" >/dev/null
done
"$bin/liquidblend" register two_drops --source drops_a --target drops_b --iterations 4 --wait \
  >/dev/null
cd "$here"
node run.mjs "$@"
