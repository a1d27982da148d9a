#!/usr/bin/env bash
# Builds the fuzzers (preset "fuzz") and runs each for a while on the seeds in corpus/.
#   tests/fuzz/run.sh [SECONDS [READER...]]     60 seconds, all readers
# A finding ends the script; its bytes are in build/fuzz/findings/READER. Once it is mended, they go
# to tests/fuzz/regressions/READER, which the test fuzz_replay_test runs in every build.
# A file of up to 64 KiB may allocate at most 48 MiB at once and must be read within 10 seconds.
set -euo pipefail
usage() { sed -n '2,/^set -/s/^# \{0,1\}//p' "$0"; }
refuse() { echo "run.sh: $1" >&2; usage >&2; exit 2; }
if [ "${1:-}" = --help ]; then usage; exit 0; fi
seconds=${1:-60}
[[ $seconds =~ ^[0-9]+$ ]] || refuse "unknown argument: $seconds"
shift || true
readers=("$@")
[ ${#readers[@]} -gt 0 ] ||
  readers=(mantaflow ply obj stl vdb gzip meta animation_file family_file surface query)

for reader in "${readers[@]}"; do
  [ -d "$(dirname "$0")/corpus/$reader" ] || refuse "unknown reader: $reader"
done
cd "$(dirname "$0")/../.."

cmake --preset fuzz >/dev/null
cmake --build build/fuzz --target "${readers[@]/#/fuzz_}"
for reader in "${readers[@]}"; do
  echo "== $reader"
  corpus=build/fuzz/corpus/$reader
  findings=build/fuzz/findings/$reader
  mkdir -p "$corpus" "$findings"
  ASAN_OPTIONS=allocator_may_return_null=0 UBSAN_OPTIONS=print_stacktrace=1 \
    "build/fuzz/fuzz/fuzz_$reader" "$corpus" "tests/fuzz/corpus/$reader" \
    -max_total_time="$seconds" -max_len=65536 -malloc_limit_mb=48 -timeout=10 \
    -artifact_prefix="$findings/" -print_final_stats=1 -verbosity=0 2>"$findings/log" ||
    { tail -n 60 "$findings/log" >&2; echo "$reader: a finding, see $findings" >&2; exit 1; }
  grep -E 'number_of_executed_units|peak_rss_mb' "$findings/log"
done
