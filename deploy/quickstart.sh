#!/usr/bin/env bash
# From nothing to moving water: installs, builds, starts a server with a worker, imports the two
# bundled simulations, registers them, streams blended frames, and leaves pictures to look at.
# Asks nothing; run it again at any time: the store, DIR/data, keeps all that is in it, and what is
# there already is not made again. In a terminal the server goes on, for its page in a browser, until
# Ctrl+C; otherwise it stops at the end.
#   deploy/quickstart.sh [--programs FOLDER]
#   --programs FOLDER  programs that are built already; installs and builds nothing
#   OUT=DIR            where things go (default out)
set -euo pipefail
usage() { sed -n '2,/^set -/s/^# \{0,1\}//p' "$0"; }
refuse() { echo "quickstart.sh: $1" >&2; usage >&2; exit 2; }
bin=
case ${1:-} in
  '') ;;
  --help) usage; exit 0 ;;
  --programs)
    [ -x "${2:-}/liquidblend" ] || refuse "--programs: no liquidblend in ${2:-FOLDER}"
    bin=$(realpath "$2")
    shift 2
    ;;
  *) refuse "unknown argument: $1" ;;
esac
[ $# = 0 ] || refuse "unknown argument: $1"
cd "$(dirname "$0")/.."

out=${OUT:-out}
data=$out/data
say() { printf '\n== %s\n' "$*"; }

# A folder that is no store may hold anything. Another server would have its log replaced, too.
if [ -n "$(ls -A "$data" 2>/dev/null)" ] && [ ! -f "$data/catalog.sqlite" ] && [ ! -f "$data/server.lock" ]; then
  refuse "$data is there and is no store of liquidblend: choose another place, OUT=DIR"
fi
if [ -f "$data/server.lock" ] && ! flock --nonblock "$data/server.lock" true; then
  refuse "a server runs on $data already, process $(cat "$data/server.lock"): stop it, or choose another place, OUT=DIR"
fi

if [ -z "$bin" ]; then
  bin=build/release/bin
  say "1/6 packages"
  deploy/install-deps.sh --quickstart

  say "2/6 build"
  export CCACHE_BASEDIR=$PWD CCACHE_NOHASHDIR=1  # as tests/run.sh: what one has built is there for the other
  cmake --preset release >/dev/null
  cmake --build --preset release -j "$(nproc)" --target liquidblend liquidblend-admin \
    liquidblend-server liquidblend-worker
fi

say "3/6 server and worker"
mkdir -p "$out"
"$bin/liquidblend-server" --data "$data" --listen 127.0.0.1:0 --http 127.0.0.1:0 --workers 1 >"$out/server.out" 2>"$out/server.log" &
server=$!
stop() {
  kill "$server" 2>/dev/null || true
  wait "$server" 2>/dev/null || true
}
trap stop EXIT
for _ in $(seq 100); do
  grep -q '^http on ' "$out/server.out" 2>/dev/null && break
  kill -0 "$server" 2>/dev/null || { echo "the server did not start:"; cat "$out/server.log"; exit 1; }
  sleep 0.1
done
LIQUIDBLEND_SERVER=$(sed -n 's/^listening on //p' "$out/server.out")
export LIQUIDBLEND_SERVER
[ -n "$LIQUIDBLEND_SERVER" ] || { echo "the server did not start in time:"; cat "$out/server.log"; exit 1; }
http=http://$(sed -n 's/^http on //p' "$out/server.out")
echo "listening on $LIQUIDBLEND_SERVER, $http/v1/families, data in $data, log in $out/server.log"

# unless_there NAME COMMAND..: runs the command, which makes NAME, unless an earlier run has.
unless_there() {
  local name=$1 running found
  shift
  # If that was stopped meanwhile, its job goes on at this server.
  running=$("$bin/liquidblend" operations |
    awk -v name="$name" '/ (queued|running) / && ($3 == name || $3 == name ",") { print $1 }')
  [ -z "$running" ] || "$bin/liquidblend" operations "$running" --wait || true
  found=$("$bin/liquidblend" inspect "$name" 2>/dev/null) || true
  case $found in
    "$name: ready"* | "$name: version"*) echo "$name is there already, and stays as it is" ;;
    *) "$@" ;;
  esac
}

say "4/6 import and register: in A the left drop strikes first, in B the right one"
unless_there animations/drops_a "$bin/liquidblend" import drops_a tests/data/two_drops/A
unless_there animations/drops_b "$bin/liquidblend" import drops_b tests/data/two_drops/B
unless_there families/two_drops \
  "$bin/liquidblend" register two_drops --source drops_a --target drops_b --wait
"$bin/liquidblend" list

say "5/6 blended frames"
"$bin/liquidblend" stream two_drops --seconds 3 --fps 24 --sweep
"$bin/liquidblend" export two_drops --weights 0.5 -o "$out/half" --format ply --overwrite
"$bin/liquidblend" frame two_drops --weights 0.5 --time 0.5 -o "$out/half.drc"
"$bin/liquidblend" inspect "$out/half.drc"

say "6/6 pictures"
"$bin/liquidblend" render two_drops --weights 0 --weights 0.25 --weights 0.5 --weights 0.75 --weights 1 \
  --times 0,0.25,0.42,0.67,1.0,1.5 -o "$out/blend.png"
BASE_URL=$http node tests/e2e/web/picture.mjs "$out/page.png" ||
  echo "no picture of the page: see above" >&2

cat <<TEXT

Done.
  $out/blend.png     A (top), 0.25, 0.5, 0.75, B (bottom) over time: at 0.5 both drops strike at once,
                     which neither simulation does
  $out/page.png      the page that the server has for browsers
  $out/half/         the whole animation at weight 0.5, one PLY a frame
  $out/half.drc      one Draco frame

Try next:
  $bin/liquidblend-server --data $data --http 127.0.0.1:8080 &   # serves what was registered
  xdg-open http://127.0.0.1:8080/   # its page: play, blend, upload and register simulations of your own
  curl -o frame.drc 'http://127.0.0.1:8080/v1/families/two_drops/frame.drc?weights=0.5&time=0.8'
  $bin/liquidblend frame two_drops --weights 1.25 --time 0.8 -o beyond_b.ply
  $bin/liquidblend stream two_drops --seconds 10 --fps 60 --sweep
  $bin/liquidblend import mine /path/to/frames  # Mantaflow cache, PLY, OBJ, STL or OpenVDB sequence
  $bin/liquidblend --help
TEXT

if [ -t 0 ] && [ -t 1 ]; then
  printf '\nOpen %s/ in a browser. Ctrl+C stops the server.\n' "$http"
  trap 'echo; exit 0' INT
  wait "$server"
fi
