#!/usr/bin/env bash
# Runs programs of an earlier commit with the current ones, on a data directory and on PostgreSQL
# with S3: the current client against the former server, the current server on the former one's
# store, and the former client against the current server. Compares the frames of both. Then replaces
# two servers and a worker of that commit under load, one after the other.
#   tests/compatibility.sh COMMIT
#   PROGRAMS=DIRECTORY  that commit's programs, if they are built already
# Needs the programs of build/release, and steady_client of its tests. Prints a line for each
# command; exits 1 if one failed that worked with that commit's own server, except for what
# docs/operations/upgrades.md says.
set -euo pipefail
usage() { sed -n '2,/^set -/s/^# \{0,1\}//p' "$0"; }
refuse() { echo "compatibility.sh: $1" >&2; usage >&2; exit 2; }
case ${1:-} in
  --help) usage; exit 0 ;;
  '') refuse "no COMMIT given" ;;
  -*) refuse "unknown argument: $1" ;;
esac
[ $# = 1 ] || refuse "one COMMIT is wanted, not: $*"
cd "$(dirname "$0")/.."
git rev-parse --quiet --verify "$1^{commit}" >/dev/null || refuse "no commit: $1"

current=$PWD/build/release/bin
steady_client=$PWD/build/release/tests/steady_client
work=$(mktemp -d)
. tests/servers.sh
declare -A pids=()  # of what roll() starts, by name
clean_up() {
  stop_server
  local name
  for name in "${!pids[@]}"; do end "${pids[$name]}"; done
  stop_shared_stores
  [ ! -d "$work/source" ] || git worktree remove --force "$work/source"
  rm -rf "$work"
}
trap clean_up EXIT
chmod 755 "$work"

build_programs() {
  echo "building the programs of $1" >&2
  git worktree add --quiet --detach "$work/source" "$1"
  (cd "$work/source" && export CCACHE_BASEDIR=$PWD CCACHE_NOHASHDIR=1 &&
    cmake --preset release && cmake --build --preset release -j "$(nproc)" \
      --target liquidblend liquidblend-server liquidblend-worker) \
    >"$work/build.log" 2>&1 || { cat "$work/build.log" >&2; exit 1; }
  echo "$work/source/build/release/bin"
}
former=${PROGRAMS:-$(build_programs "$1")}

# Nine frames of a ball that moves along x at so many metres per second: make_ball DIRECTORY VELOCITY
make_ball() {
  python3 - "$@" <<'PYTHON'
import math, os, sys
directory, velocity = sys.argv[1], float(sys.argv[2])
os.makedirs(directory)
rows, columns = 12, 24
for frame in range(9):
    x = velocity * frame / 24
    points = [(x, 0, 1)] + [
        (x + math.sin(math.pi * r / rows) * math.cos(2 * math.pi * c / columns),
         math.sin(math.pi * r / rows) * math.sin(2 * math.pi * c / columns),
         math.cos(math.pi * r / rows))
        for r in range(1, rows) for c in range(columns)] + [(x, 0, -1)]
    at = lambda r, c: 1 + (r - 1) * columns + c % columns
    faces = [(0, at(1, c), at(1, c + 1)) for c in range(columns)]
    for r in range(1, rows - 1):
        for c in range(columns):
            faces.append((at(r, c), at(r + 1, c), at(r + 1, c + 1)))
            faces.append((at(r, c), at(r + 1, c + 1), at(r, c + 1)))
    faces += [(at(rows - 1, c), len(points) - 1, at(rows - 1, c + 1)) for c in range(columns)]
    with open(f"{directory}/ball_{frame + 1:04d}.ply", "w") as ply:
        ply.write(f"ply\nformat ascii 1.0\nelement vertex {len(points)}\n")
        ply.write("property float x\nproperty float y\nproperty float z\n")
        ply.write(f"element face {len(faces)}\nproperty list uchar int vertex_indices\nend_header\n")
        ply.writelines("%.6f %.6f %.6f\n" % point for point in points)
        ply.writelines("3 %d %d %d\n" % face for face in faces)
PYTHON
}
make_ball "$work/a" 1
make_ball "$work/b" 2
make_ball "$work/c" 3
cat >"$work/pairs.json" <<'JSON'
{"correspondences": [[{"source": {"position": [0, 0, 1], "time_s": 0}, "target": {"position": [0, 0, 1], "time_s": 0}}]]}
JSON

failed=0
tier=
# try CLIENT WORDS...: what that client does with them on the server that runs.
try() {
  local status=0
  "$1/liquidblend" --server "$server" "${@:2}" >"$work/log" 2>&1 || status=$?
  printf '%-9s %-7s %-7s %-4s %s\n' "$tier" "$(name_of "$1")" "$serving" \
    "$([ $status = 0 ] && echo ok || echo "$status")" "${*:2}"
  [ $status != 0 ] || return 0
  sed 's/^/    /' "$work/log"
  return 1
}
must() { try "$@" || failed=1; }
# refused TEXT CLIENT WORDS...: the command must fail, with TEXT in what it says.
refused() {
  if try "${@:2}" >"$work/refused"; then
    echo "    was not refused"
    failed=1
  elif ! grep -q "$1" "$work/log"; then
    cat "$work/refused"
    failed=1
  else
    sed -n '1s/$/ (refused, as it must be)/p' "$work/refused"
  fi
}
name_of() { [ "$1" = "$current" ] && echo current || echo former; }
same() {
  cmp -s "$1" "$2" && return
  echo "$tier: $(basename "$1") and $(basename "$2") differ"
  failed=1
}

# run_commands CLIENT OTHER: all that CLIENT can do. Its frames must be those that OTHER gets.
run_commands() {
  local client=$1 other=$2
  local out=$work/out-$tier-$serving
  mkdir "$out"
  must "$client" import a "$work/a" --fps 24
  must "$client" --no-direct import b "$work/b" --fps 24
  must "$client" register balls --source a --target b --iterations 3 --wait
  # Servers of before replace a family whose name is taken: upgrades.md.
  [ "$serving" = former ] ||
    refused 'already' "$client" register balls --source b --target a --iterations 3 --wait
  must "$client" list
  must "$client" inspect balls
  must "$client" frame balls -w 0.5 -t 0.1 -o "$out/one.ply"
  "$other/liquidblend" --quiet --server "$server" frame balls -w 0.5 -t 0.1 -o "$out/two.ply" >/dev/null
  same "$out/one.ply" "$out/two.ply"
  must "$client" export balls -w 0.5 -o "$out/one"
  "$other/liquidblend" --quiet --server "$server" export balls -w 0.5 -o "$out/two" >/dev/null
  same "$out/one/frame_0009.ply" "$out/two/frame_0009.ply"
  must "$client" stream balls --seconds 1
  must "$client" render balls --columns 2 -w 0.5 --size 64x48 -o "$out/one.png"
  must "$client" register balls --refine --correspondences "$work/pairs.json" --iterations 3 --wait
  must "$client" inspect balls --correspondences-json "$out/pairs.json"
  must "$client" operations
  if [ "$tier" = shared ]; then
    # Blobs are named by another checksum since then: upgrades.md.
    try "$client" download families/balls -o "$out/balls" ||
      { [ "$client" = "$former" ] && grep -q 'has the checksum' "$work/log"; } || failed=1
  fi
  must "$client" delete balls
}

# serve PROGRAMS ARGUMENTS...: starts their server; sets $serving to "former" or "current".
serve() {
  serving=$(name_of "$1")
  start_server "$1/liquidblend-server" "${@:2}"
}

# run_programs ARGUMENTS...: both servers, one after the other, with these arguments and so one store.
run_programs() {
  serve "$former" "$@"
  run_commands "$current" "$former"
  must "$former" register kept --source a --target b --iterations 3 --wait
  must "$former" export kept -w 0.5 -o "$work/kept-$tier"
  stop_server
  serve "$current" "$@"
  must "$current" inspect kept
  must "$current" export kept -w 0.5 -o "$work/kept-$tier-again"
  local file
  for file in "$work/kept-$tier"/*.ply; do same "$file" "$work/kept-$tier-again/$(basename "$file")"; done
  must "$current" register kept --refine --iterations 3 --wait
  must "$current" delete kept
  must "$current" delete animations/a
  must "$current" delete animations/b
  run_commands "$former" "$current"
  stop_server
}

tier=embedded
run_programs --data "$work/data"

tier=shared
start_shared_stores
run_programs "${store[@]}" --cache "$work/cache" --client-s3 "$AWS_ENDPOINT_URL"

# start_replica PROGRAMS NAME ADDRESS: a server without workers; returns once it serves.
start_replica() {
  "$1/liquidblend-server" --listen "$3" --workers 0 --grace 10s "${store[@]}" \
    --cache "$work/cache-$2" >"$work/$2.out" 2>>"$work/$2.log" &
  pids[$2]=$!
  for _ in $(seq 300); do
    ! "$1/liquidblend-server" --check --listen "$3" >/dev/null 2>&1 || return 0
    sleep 0.1
  done
  cat "$work/$2.log" >&2
  echo "$2 did not start" >&2
  exit 1
}

start_worker() {
  "$1/liquidblend-worker" "${store[@]}" --cache "$work/cache-worker" >/dev/null 2>>"$work/worker.log" &
  pids[worker]=$!
}

# Whether half of the targets of an operation are registered, and not all of it is done.
is_half_done() {
  "$former/liquidblend" --server "$server" operations "$1" --json | python3 -c '
import json, sys
said = json.load(sys.stdin)
said = said[0] if isinstance(said, list) else said
sys.exit(not 0.45 <= said["progress"]["fraction"] < 0.9)'
}

# Waits for that, so that a worker of each version registers a target.
await_half_done() {
  for _ in $(seq 600); do
    ! is_half_done "$1" || return 0
    sleep 0.1
  done
  cat "$work/worker.log" >&2
  echo "$1 was not half done in time: nothing was shared by two versions" >&2
  exit 1
}

# Replaces former servers and a former worker by current ones, while a client asks for frames, and
# operations are under way: one that was accepted before, and one of two targets, the first of which
# the former worker registers.
roll() {
  tier=roll
  local one two
  read -r one two < <(tests/free_ports.sh 2)
  one=127.0.0.1:$one
  two=127.0.0.1:$two
  start_replica "$former" one "$one"
  start_replica "$former" two "$two"
  start_worker "$former"
  server=$one,$two
  serving=former
  must "$former" import c "$work/c" --fps 24
  must "$former" register balls --source a --target b --iterations 3 --wait
  must "$former" register rolled --source a --target b --iterations 100
  local operation
  operation=$(grep -o 'operations/[^ ]*' "$work/log" | head -n 1)
  "$steady_client" "$server" balls >"$work/steady" 2>&1 &
  local steady=$!
  pids[steady]=$steady
  sleep 2
  end "${pids[one]}"
  start_replica "$current" one "$one"
  must "$current" list  # with old and new servers side by side
  end "${pids[two]}"
  start_replica "$current" two "$two"
  serving=current
  must "$former" register shared --source a --target b --target c --iterations 200
  local shared
  shared=$(grep -o 'operations/[^ ]*' "$work/log" | head -n 1)
  await_half_done "$shared"
  end "${pids[worker]}"
  start_worker "$current"
  must "$current" operations "$shared" --wait
  must "$current" frame shared -w 0.5,0.25 -t 0.1 -o "$work/shared.ply"
  must "$current" operations "$operation" --wait
  must "$current" frame rolled -w 0.5 -t 0.1 -o "$work/rolled.ply"
  sleep 2
  kill -TERM "$steady"
  wait "$steady" || failed=1
  unset 'pids[steady]'
  sed "s/^/$tier      /" "$work/steady"
}
roll
exit $failed
