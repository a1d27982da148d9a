#!/usr/bin/env bash
# Runs the blocks of a page of docs/ against a server of its own with a family two_drops, then
# check_PAGE.py beside this script, if there is one: whether the blocks came to what the page says.
#   tests/docs/page.sh PAGE BUILD_DIRECTORY
# LIQUIDBLEND_BINARY_DIR: the programs, if they are not the build's.
# Exit: 0 if every block has done so; 1 if not; 2 usage; 77 the page's packages are missing.
set -euo pipefail
usage() { sed -n '2,/^set -/s/^# \{0,1\}//p' "$0"; }
refuse() { echo "page.sh: $1" >&2; usage >&2; exit 2; }
if [ "${1:-}" = --help ]; then usage; exit 0; fi
[[ ${1:-} != -* ]] || refuse "unknown argument: $1"
[ $# = 2 ] || refuse "two arguments are needed"

# Debian's Python, which has its packages, comes before others.
export PATH=/usr/bin:/bin:$PATH
for module in grpc google.protobuf websockets; do
  python3 -c "import $module" 2>/dev/null || {
    echo "page.sh: no Python module $module: run deploy/install-deps.sh" >&2
    exit 77
  }
done

page=$(realpath "$1")
build=$(realpath "$2")
checkout=$(realpath "$(dirname "$0")/../..")
programs=$(realpath "${LIQUIDBLEND_BINARY_DIR:-$build/bin}")
directory=$(mktemp -d)
server=
clean_up() {
  if [ -n "$server" ]; then kill "$server" && wait "$server" || true; fi
  rm -rf "$directory"
}
trap clean_up EXIT

"$programs/liquidblend-server" --data "$directory/data" --listen 127.0.0.1:0 \
  --http 127.0.0.1:0 >"$directory/server.out" &
server=$!
deadline=$((SECONDS + 60))
until grep -q '^http on' "$directory/server.out"; do
  [ $SECONDS -lt $deadline ] || { echo "page.sh: the server does not start" >&2; exit 1; }
  sleep 0.1
done
GRPC=$(sed -n 's/^listening on //p' "$directory/server.out")
HTTP=$(sed -n 's/^http on //p' "$directory/server.out")
for name in A B; do
  "$programs/liquidblend" --server "$GRPC" import "drops_${name,,}" \
    "$checkout/tests/data/two_drops/$name" >/dev/null
done
# One iteration is enough for the pages, but not for a good verdict (status 6).
"$programs/liquidblend" --server "$GRPC" register two_drops --source drops_a --target drops_b \
  --iterations 1 --wait >/dev/null || [ $? = 6 ]

mkdir "$directory/home"
export PATH=$programs:$PATH LIQUIDBLEND_SERVER=$GRPC
# No pipe: grep ends at its first match, and a program that still writes to it would be killed.
liquidblend operations >"$directory/operations"
OPERATION=$(grep -om1 'operations/import-[^ ]*' "$directory/operations")
export GRPC HTTP HOME=$directory/home LIQUIDBLEND=$checkout BUILD=$build
export DATA=$directory/data OPERATION
unset PREFIX
"$checkout/tests/docs/run_blocks.py" "$page" "$directory/home"
check=$checkout/tests/docs/check_$(basename "$page" .md).py
if [ -x "$check" ]; then (cd "$directory/home" && "$check"); fi
