#!/usr/bin/env bash
# Compares lb_bench of an earlier commit with the one of build/release: runs both by turns and
# prints for each benchmark the median CPU times, their ratio, and the spread of both.
#   tests/bench/by_turns.sh [--runs N] [--filter REGEX] COMMIT
#   --runs N        of each program (10)
#   --filter REGEX  benchmarks (slices and the encoder at 50,000 vertices)
#   PROGRAM=FILE    that commit's lb_bench, if it is built already
# Ratios say something on a quiet machine only: the spread is the interquartile range by the median.
set -euo pipefail
usage() { sed -n '2,/^set -/s/^# \{0,1\}//p' "$0"; }
refuse() { echo "by_turns.sh: $1" >&2; usage >&2; exit 2; }
runs=10
filter='^(BlendSlice|EncodeDraco)/vertices:50000/'
commit=
while [ $# -gt 0 ]; do
  case $1 in
    --help) usage; exit 0 ;;
    --runs) runs=${2:?}; shift ;;
    --filter) filter=${2:?}; shift ;;
    -*) refuse "unknown argument: $1" ;;
    *) [ -z "$commit" ] || refuse "one COMMIT is wanted, not: $commit $1"; commit=$1 ;;
  esac
  shift
done
[ -n "$commit" ] || refuse "no COMMIT given"
cd "$(dirname "$0")/../.."
git rev-parse --quiet --verify "$commit^{commit}" >/dev/null || refuse "no commit: $commit"
current=$PWD/build/release/bin/lb_bench
[ -x "$current" ] || refuse "not built: $current"

work=$(mktemp -d)
clean_up() {
  [ ! -d "$work/source" ] || git worktree remove --force "$work/source"
  rm -rf "$work"
}
trap clean_up EXIT
build() {
  echo "building lb_bench of $commit" >&2
  git worktree add --quiet --detach "$work/source" "$commit"
  (cd "$work/source" && export CCACHE_BASEDIR=$PWD CCACHE_NOHASHDIR=1 &&
    cmake --preset release && cmake --build --preset release -j "$(nproc)" --target lb_bench) \
    >"$work/build.log" 2>&1 || { tail -n 30 "$work/build.log" >&2; exit 1; }
  echo "$work/source/build/release/bin/lb_bench"
}
former=${PROGRAM:-$(build)}

# The order changes each time, so that neither always runs after the other.
for run in $(seq "$runs"); do
  order=(former current)
  [ $((run % 2)) = 0 ] || order=(current former)
  for which in "${order[@]}"; do
    echo "run $run of $runs: $which" >&2
    "${!which}" --benchmark_filter="$filter" --benchmark_format=json >"$work/$which.$run.json"
  done
done

python3 - "$work" "$commit" <<'PYTHON'
import collections, glob, json, statistics, sys
work, commit = sys.argv[1:]

def times(which):
    found = collections.defaultdict(list)
    for name in glob.glob(f"{work}/{which}.*.json"):
        for run in json.load(open(name))["benchmarks"]:
            found[run["name"]].append(run["cpu_time"])
            units[run["name"]] = run["time_unit"]
    return found

def spread(values):
    quarters = statistics.quantiles(values, n=4) if len(values) > 1 else [0, 0, 0]
    return (quarters[2] - quarters[0]) / statistics.median(values)

units = {}
former, current = times("former"), times("current")
if not former.keys() & current.keys():
    sys.exit("by_turns.sh: no benchmark is in both programs")
print(f"| benchmark | {commit} | now | ratio | spread |\n| --- | --- | --- | --- | --- |")
for name in former:
    if name not in current:
        continue
    a, b = statistics.median(former[name]), statistics.median(current[name])
    print(f"| {name} | {a:.3g} {units[name]} | {b:.3g} {units[name]} | {b / a:.3f} | "
          f"{spread(former[name]):.1%}, {spread(current[name]):.1%} |")
PYTHON
