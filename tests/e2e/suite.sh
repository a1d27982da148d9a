#!/usr/bin/env bash
# Runs a suite of the e2e tests where they are installed, as in the image e2e of
# deploy/Containerfile; in a build, ctest does that.
#   suite.sh embedded|shared|faults|running    (tests/e2e/CMakeLists.txt says what is in which)
# shared wants the S3 of AWS_ENDPOINT_URL, AWS_ACCESS_KEY_ID, .. with a bucket liquidblend; running
# the servers of LIQUIDBLEND_E2E_SERVERS, whose store it empties. All else the tests start
# themselves. Prints a line a program; of one that fails, all that it has said.
# Exit: 0 if every test has passed; 1 if not; 2 usage.
set -euo pipefail
usage() { sed -n '2,/^set -/s/^# \{0,1\}//p' "$0"; }
refuse() { echo "suite.sh: $1" >&2; usage >&2; exit 2; }
here=$(cd "$(dirname "$0")" && pwd)
suite=${1:-}
case $suite in
  --help) usage; exit 0 ;;
  embedded | shared | faults | running) [ $# = 1 ] || refuse "unknown argument: $2" ;;
  *) refuse "unknown suite: $suite" ;;
esac
grep -q "^$suite " "$here/e2e_tests.txt" || refuse "not in $here/e2e_tests.txt: $suite"
[ "$suite" != running ] || : "${LIQUIDBLEND_E2E_SERVERS:?is not set}"
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
export LIQUIDBLEND_FAULT_TABLE=$work/faults.md
if [ "$suite" = shared ]; then
  export LIQUIDBLEND_E2E_TIER=shared LIQUIDBLEND_CEPH=$work
  env | grep ^AWS_ >"$work/s3.env"
fi

# run PROGRAM [ARGUMENT..]: whether all of its tests pass, and none is left out
run() {
  local program=$1 begin=$SECONDS passed
  shift
  "$here/$program" "$@" </dev/null >"$work/log" 2>&1 || return 1
  passed=$(sed -n 's/^\[  PASSED  \] \([0-9]*\) tests\{0,1\}\.$/\1/p' "$work/log")
  [ "${passed:-0}" -gt 0 ] && ! grep -q '^\[  SKIPPED \]' "$work/log" || return 1
  total=$((total + passed))
  echo "$program: $passed tests, $((SECONDS - begin)) s"
}

total=0
status=0
while read -r of program arguments; do
  [ "$of" = "$suite" ] || continue
  # shellcheck disable=SC2086  # words
  run "$program" $arguments && continue
  cat "$work/log"
  echo "$program: FAILED"
  status=1
done <"$here/e2e_tests.txt"
echo "$suite: $total tests passed, $SECONDS s"
if [ -f "$LIQUIDBLEND_FAULT_TABLE" ]; then
  awk -F' *[|] *' '{++lines[$3]; lost += $8} END {
    printf "fault table: "
    for (tier in lines) printf "%d lines %s, ", lines[tier], tier
    print lost + 0 " lost" }' "$LIQUIDBLEND_FAULT_TABLE"
fi
exit $status
