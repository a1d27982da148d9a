#!/usr/bin/env bash
# Runs the end-to-end tests of the release build with programs of a sanitizer's.
#   tests/sanitized.sh asan|tsan [CTEST_ARGUMENT..]     such as: -R StopTest
# What a sanitizer reports is in build/PRESET/reports.
# Exit: 0 if every test has passed and nothing was reported; 1 if not; 2 usage.
set -euo pipefail
usage() { sed -n '2,/^set -/s/^# \{0,1\}//p' "$0"; }
refuse() { echo "sanitized.sh: $1" >&2; usage >&2; exit 2; }
preset=${1:-}
case $preset in
  --help) usage; exit 0 ;;
  asan | tsan) shift ;;
  *) refuse "unknown sanitizer: $preset" ;;
esac
cd "$(dirname "$0")/.."
programs=(liquidblend liquidblend-admin liquidblend-server liquidblend-worker)
export CCACHE_BASEDIR=$PWD CCACHE_NOHASHDIR=1  # another clone of the same sources hits the cache

cmake --preset "$preset" >/dev/null
cmake --build --preset "$preset" --target "${programs[@]}"
cmake --preset release >/dev/null
cmake --build --preset release

reports=$PWD/build/$preset/reports
rm -rf "$reports"
mkdir -p "$reports"
export ASAN_OPTIONS=log_path=$reports/asan
export UBSAN_OPTIONS=log_path=$reports/ubsan:print_stacktrace=1:halt_on_error=1
# intercept_tls_get_addr: docs/experiments/sanitizers-and-fuzzing.md
export LSAN_OPTIONS=suppressions=$PWD/tests/lsan.supp:print_suppressions=0:intercept_tls_get_addr=0
# A worker that is told to stop within a long stage ends without joining its threads.
export TSAN_OPTIONS="log_path=$reports/tsan ignore_noninstrumented_modules=1 report_thread_leaks=0
  suppressions=$PWD/tests/tsan/libraries.supp"
export LIQUIDBLEND_BINARY_DIR=$PWD/build/$preset/bin LIQUIDBLEND_E2E_PATIENCE=600
# Clang links AddressSanitizer's runtime into each program. ThreadSanitizer's of GCC is a library,
# which comes before the layer of faults.
export LIQUIDBLEND_E2E_SANITIZER=linked
[ "$preset" = asan ] || LIQUIDBLEND_E2E_SANITIZER=$(g++ -print-file-name="lib$preset.so")
# A frame of docs.c-api takes longer with ThreadSanitizer than its program plays.
left_out=()
[ "$preset" = asan ] || left_out=(-E '^docs\.c-api$')
status=0
ctest --preset release --timeout 3000 --no-tests=error -L '^e2e$' "${left_out[@]}" "$@" || status=1
if [ -n "$(ls "$reports")" ]; then
  head -n 40 "$reports"/*
  status=1
fi
exit $status
