#!/usr/bin/env bash
# Builds the fuzzers (preset "fuzz") and runs each for a while on the seeds in corpus/, one after
# the other. Prints a table at the end; "CPU seconds" say how much of the time it had a core.
#   tests/fuzz/run.sh [SECONDS [TARGET...]]     600 seconds, all targets: about three hours and a half
# A finding ends its target but not the others; then the exit status is 1. Its bytes and the log are
# in build/fuzz/findings/TARGET. Once it is mended, the bytes go to tests/fuzz/regressions/TARGET,
# which the test fuzz_test runs in every build.
# An input of up to 64 KiB may allocate at most 48 MiB at once (draco: 384, libdraco 1.5.5 takes 256
# for what a mesh claims to say about texture coordinates) and must be done within 10 seconds.
set -euo pipefail
usage() { sed -n '2,/^set -/s/^# \{0,1\}//p' "$0"; }
refuse() { echo "run.sh: $1" >&2; usage >&2; exit 2; }
if [ "${1:-}" = --help ]; then usage; exit 0; fi
seconds=${1:-600}
[[ $seconds =~ ^[0-9]+$ ]] || refuse "unknown argument: $seconds"
shift || true
readers=(mantaflow ply obj stl vdb gzip meta animation_file family_file meshopt draco surface
  query s3_answer credentials)
peers=(http websocket stream tokens upload pages)
targets=("$@")
[ ${#targets[@]} -gt 0 ] || targets=("${readers[@]}" "${peers[@]}")

for target in "${targets[@]}"; do
  [ -d "$(dirname "$0")/corpus/$target" ] || refuse "unknown target: $target"
done
cd "$(dirname "$0")/../.."

cmake --preset fuzz >/dev/null
cmake --build build/fuzz --target "${targets[@]/#/fuzz_}"

# A statistic of libFuzzer in a log, or "?" if it ended without any.
statistic() { sed -n "s/^stat::$1: *//p" "$2" | tail -n 1 | grep . || echo "?"; }

# Sets cpu_seconds to the user and system time of what this script has run to its end. (A subshell
# would see none of it.)
measure_cpu_seconds() {
  times >build/fuzz/times
  cpu_seconds=$(tail -n 1 build/fuzz/times | sed 's/[ms]/ /g' |
    awk '{print int(60 * ($1 + $3) + $2 + $4)}')
}

rows=()
status=0
for target in "${targets[@]}"; do
  echo "== $target"
  corpus=build/fuzz/corpus/$target
  findings=build/fuzz/findings/$target
  mkdir -p "$corpus" "$findings"
  malloc_limit_mb=48
  [ "$target" != draco ] || malloc_limit_mb=384
  options=(-max_total_time="$seconds" -max_len=65536 -malloc_limit_mb="$malloc_limit_mb"
    -timeout=10)
  # Runs of the peers touch so much code that weighing it takes libFuzzer longer than the runs, and
  # their metrics and loggers are kept on purpose.
  if [[ " ${peers[*]} " == *" $target "* ]]; then options+=(-entropic=0 -detect_leaks=0); fi
  num_findings=0
  begin=$SECONDS
  measure_cpu_seconds
  cpu_begin=$cpu_seconds
  # intercept_tls_get_addr: docs/experiments/sanitizers-and-fuzzing.md
  if ! ASAN_OPTIONS=allocator_may_return_null=0:intercept_tls_get_addr=0 \
    UBSAN_OPTIONS=print_stacktrace=1 \
    "build/fuzz/fuzz/fuzz_$target" "$corpus" "tests/fuzz/corpus/$target" "${options[@]}" \
    -artifact_prefix="$findings/" -print_final_stats=1 -verbosity=0 2>"$findings/log"; then
    tail -n 60 "$findings/log" >&2
    echo "$target: a finding, see $findings" >&2
    num_findings=1
    status=1
  fi
  measure_cpu_seconds
  rows+=("| $target | $(statistic number_of_executed_units "$findings/log") | $((SECONDS - begin)) \
| $((cpu_seconds - cpu_begin)) | $(statistic peak_rss_mb "$findings/log") | $num_findings |")
done

printf '\n| target | executions | seconds | CPU seconds | peak RSS (MiB) | findings |\n'
echo "| --- | --- | --- | --- | --- | --- |"
printf '%s\n' "${rows[@]}"
exit $status
