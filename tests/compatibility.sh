#!/usr/bin/env bash
# Runs the command-line client of an earlier commit against the current servers and workers, on a
# data directory and on PostgreSQL with S3, and compares its frames with the current client's.
#   tests/compatibility.sh COMMIT
#   CLIENT=FILE  that client, if it is built already
# Needs the programs of build/release. Prints a line for each command; exits 1 if one failed that
# worked with that commit's own server, except for what docs/operations/upgrades.md says.
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

bin=$PWD/build/release/bin
work=$(mktemp -d)
pids=()
stop_all() {
  for ((k = ${#pids[@]} - 1; k >= 0; --k)); do
    kill "${pids[k]}" 2>/dev/null || true
    wait "${pids[k]}" 2>/dev/null || true
  done
  pids=()
}
clean_up() {
  stop_all
  [ ! -d "$work/ceph" ] || tests/ceph.sh stop "$work/ceph" || true
  [ ! -d "$work/source" ] || git worktree remove --force "$work/source"
  rm -rf "$work"
}
trap clean_up EXIT
chmod 755 "$work"

build_client() {
  echo "building the client of $1" >&2
  git worktree add --quiet --detach "$work/source" "$1"
  (cd "$work/source" && export CCACHE_BASEDIR=$PWD CCACHE_NOHASHDIR=1 &&
    cmake --preset release && cmake --build --preset release -j "$(nproc)" --target liquidblend) \
    >"$work/build.log" 2>&1 || { cat "$work/build.log" >&2; exit 1; }
  echo "$work/source/build/release/bin/liquidblend"
}
former=${CLIENT:-$(build_client "$1")}
current=$bin/liquidblend

# Six frames of a ball that moves along x at so many metres per second: make_ball DIRECTORY VELOCITY
make_ball() {
  python3 - "$@" <<'PYTHON'
import math, os, sys
directory, velocity = sys.argv[1], float(sys.argv[2])
os.makedirs(directory)
rows, columns = 12, 24
for frame in range(6):
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
cat >"$work/pairs.json" <<'JSON'
{"correspondences": [[{"source": {"position": [0, 0, 1], "time_s": 0}, "target": {"position": [0, 0, 1], "time_s": 0}}]]}
JSON

failed=0
tier=
# try WORDS...: what the former client does with them.
try() {
  local status=0
  "$former" --server "$server" "$@" >"$work/log" 2>&1 || status=$?
  printf '%-9s %-4s %s\n' "$tier" "$([ $status = 0 ] && echo ok || echo "$status")" "$*"
  [ $status != 0 ] || return 0
  sed 's/^/    /' "$work/log"
  return 1
}
must() { try "$@" || failed=1; }
same() {
  cmp -s "$1" "$2" && return
  echo "$tier: $(basename "$1") differs from what the current client gets"
  failed=1
}

# Requires: $server.
run_commands() {
  local out=$work/out-$tier
  mkdir "$out"
  must import a "$work/a" --fps 24
  must --no-direct import b "$work/b" --fps 24
  must register balls --source a --target b --iterations 3 --wait
  must list
  must inspect balls
  must frame balls -w 0.5 -t 0.1 -o "$out/former.ply"
  "$current" --quiet --server "$server" frame balls -w 0.5 -t 0.1 -o "$out/current.ply" >/dev/null
  same "$out/former.ply" "$out/current.ply"
  must export balls -w 0.5 -o "$out/former"
  "$current" --quiet --server "$server" export balls -w 0.5 -o "$out/current" >/dev/null
  same "$out/former/frame_0006.ply" "$out/current/frame_0006.ply"
  must stream balls --seconds 1
  must render balls --columns 2 -w 0.5 --size 64x48 -o "$out/former.png"
  must register balls --refine --correspondences "$work/pairs.json" --iterations 3 --wait
  must inspect balls --correspondences-json "$out/pairs.json"
  must operations
  if [ "$tier" = shared ]; then
    try download families/balls -o "$out/balls" || grep -q 'has the checksum' "$work/log" || failed=1
  fi
  must delete balls
}

# start_server ARGUMENTS...: sets $server.
start_server() {
  "$bin/liquidblend-server" --listen 127.0.0.1:0 --workers 1 "$@" >"$work/server.out" \
    2>"$work/server.log" &
  pids+=($!)
  for _ in $(seq 300); do
    server=$(sed -n 's/^listening on //p' "$work/server.out")
    [ -z "$server" ] || return 0
    kill -0 "${pids[-1]}" 2>/dev/null || break
    sleep 0.1
  done
  cat "$work/server.log" >&2
  echo "the server did not start" >&2
  exit 1
}

tier=embedded
start_server --data "$work/data"
run_commands
stop_all

tier=shared
tests/postgres.sh "$work/postgres" &
pids+=($!)
tests/ceph.sh start "$work/ceph" >/dev/null
set -a
# shellcheck disable=SC1091  # where the object store is
. "$work/ceph/s3.env"
set +a
for _ in $(seq 300); do
  ! psql -h "$work/postgres/sock" -U liquidblend -d postgres -c 'SELECT 1' >/dev/null 2>&1 || break
  sleep 0.1
done
start_server --store "postgresql://liquidblend@/postgres?host=$work/postgres/sock" \
  --blobs s3://liquidblend --cache "$work/cache" --client-s3 "$AWS_ENDPOINT_URL"
run_commands
exit $failed
