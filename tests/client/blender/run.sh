#!/usr/bin/env bash
# Tests the Blender add-on, installed from its zip, in Blender without a window: against a server of
# its own, a family's file and a baked folder.
#   tests/client/blender/run.sh BUILD_DIRECTORY [SCRIPT.py [ARGUMENT ..]]
# SCRIPT.py, which runs in Blender, is addon_test.py unless given; render_many.py and
# measure_mesh.py are others.
# Exit: 0 if all has passed; 1 if not; 2 usage; 77 Blender is not installed.
set -euo pipefail
usage() { sed -n '2,/^set -/s/^# \{0,1\}//p' "$0"; }
refuse() { echo "run.sh: $1" >&2; usage >&2; exit 2; }
if [ "${1:-}" = --help ]; then usage; exit 0; fi
[ $# -ge 1 ] || refuse "no build directory"
[[ $1 != -* ]] || refuse "unknown argument: $1"
command -v blender >/dev/null || {
  echo "run.sh: no Blender: run deploy/install-deps.sh --blender" >&2
  exit 77
}

build=$(realpath "$1")
here=$(realpath "$(dirname "$0")")
script=$(realpath "${2:-$here/addon_test.py}")
shift "$(($# > 1 ? 2 : 1))"
checkout=$(realpath "$here/../../..")
directory=$(mktemp -d)
server=
clean_up() {
  if [ -n "$server" ]; then kill "$server" && wait "$server" || true; fi
  rm -rf "$directory"
}
trap clean_up EXIT

start_server() {
  "$build/bin/liquidblend-server" --data "$directory/data" --listen 127.0.0.1:0 \
    --http 127.0.0.1:0 >"$directory/server.out" 2>"$directory/server.err" &
  server=$!
  local deadline=$((SECONDS + 60))
  until grep -q '^listening on' "$directory/server.out"; do
    [ $SECONDS -lt $deadline ] || { echo "run.sh: the server does not start" >&2; exit 1; }
    sleep 0.1
  done
  LIQUIDBLEND_SERVER=$(sed -n 's/^listening on //p' "$directory/server.out")
  export LIQUIDBLEND_SERVER
}

# The first 24 frames and one iteration are enough here, but not for a good verdict (status 6).
register_family() {
  local name
  for name in A B; do
    mkdir "$directory/$name"
    cp "$checkout/tests/data/two_drops/$name/"{meta.json,*_00[01]?.*,*_002[0-4].*} \
      "$directory/$name"
    "$build/bin/liquidblend" import "drops_${name,,}" "$directory/$name" >/dev/null
  done
  "$build/bin/liquidblend" register two_drops --source drops_a --target drops_b --iterations 1 \
    --wait >/dev/null || [ $? = 6 ]
}

run_blender() {
  BLENDER_USER_RESOURCES=$directory/blender blender -b --factory-startup --python-exit-code 1 \
    --python "$@"
}

start_server
register_family
"$checkout/client/blender/make_zip.py" "$directory/addon.zip" \
  --library "$build/lib/libliquidblend.so.1"
family_file=$directory/two_drops.lbf
"$build/bin/liquidblend" download families/two_drops -o "$family_file" >/dev/null
unset LIQUIDBLEND_LIBRARY LIQUIDBLEND_TOKEN
run_blender "$script" -- --zip "$directory/addon.zip" --server "$LIQUIDBLEND_SERVER" \
  --file "$family_file" --folder "$directory" --data "$checkout/tests/data/two_drops" "$@"

[ "$script" = "$here/addon_test.py" ] || exit 0

# Without library and server: a bake plays, and a render of a server's frames stops.
kill "$server" && wait "$server" || true
server=
export LIQUIDBLEND_LIBRARY=$directory/nowhere.so
run_blender "$here/bake_alone_test.py" -- --folder "$directory"
unset LIQUIDBLEND_LIBRARY

# stops FILE.blend WHY: its render ends with 1, says why, and leaves no picture.
stops() {
  local status=0
  BLENDER_USER_RESOURCES=$directory/blender blender -b "$directory/$1" --python-exit-code 1 \
    --python "$here/enable_addon.py" -o "$directory/missing_####" -f 3 \
    >"$directory/render.out" 2>&1 || status=$?
  if [ $status != 1 ] || ! grep -q "no frame: .*$2" "$directory/render.out" ||
    compgen -G "$directory/missing_*" >/dev/null; then
    cat "$directory/render.out" >&2
    echo "run.sh: the render of $1 ended with status $status" >&2
    exit 1
  fi
}
stops no_server.blend UNAVAILABLE
stops not_connected.blend "not connected yet"
echo "renders without their frames stop"
