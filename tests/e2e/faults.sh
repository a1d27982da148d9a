#!/usr/bin/env bash
# The fault table: meets every fault again and again, and prints as Markdown how much of what was
# accepted or published was lost (nothing, or the exit code is 1). Needs a build with tests.
#   tests/e2e/faults.sh [BUILD_DIRECTORY]     build/release unless given
# LIQUIDBLEND_FAULT_RUNS runs a line, 20 unless set; FAULT_FILTER: some lines only, as gtest's
# filter. What the programs say goes to BUILD_DIRECTORY/faults.log.
set -euo pipefail
usage() { sed -n '2,/^set -/s/^# \{0,1\}//p' "$0"; }
refuse() { echo "faults.sh: $1" >&2; usage >&2; exit 2; }
case ${1:-} in
  --help) usage; exit 0 ;;
  -*) refuse "unknown argument: $1" ;;
esac
[ $# -le 1 ] || refuse "unknown argument: $2"
build=$(cd "${1:-$(dirname "$0")/../../build/release}" && pwd)
export LIQUIDBLEND_FAULT_RUNS=${LIQUIDBLEND_FAULT_RUNS:-20}
export LIQUIDBLEND_FAULT_TABLE=$build/faults.md
rm -f "$LIQUIDBLEND_FAULT_TABLE"
: >"$build/faults.log"

status=0
for test in kill disk network s3 clock; do
  "$build/tests/e2e_faults_${test}_test" --gtest_filter="${FAULT_FILTER:-*}" \
    >>"$build/faults.log" 2>&1 || status=1
done

echo "| fault | tier | runs | jobs accepted | attempts failed or lost | results read | lost |"
echo "| --- | --- | --- | --- | --- | --- | --- |"
[ ! -f "$LIQUIDBLEND_FAULT_TABLE" ] || cat "$LIQUIDBLEND_FAULT_TABLE"
[ $status = 0 ] || echo "some tests failed: $build/faults.log" >&2
exit $status
