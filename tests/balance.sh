#!/usr/bin/env bash
# Measures how clients fare while replicas come and go, with the server's defaults: a new one of a
# name must take a quarter of the calls within 60 s; of two, one after the other is drained under
# load (50 calls/s, 8 players, 2 streams), where no call may fail and no player may show the same
# frame for 200 ms (tests/e2e/balance_test.cc).
#   tests/balance.sh [BUILD [SECONDS]]
#     BUILD    folder of the build, with the target e2e_balance_test (build/release)
#     SECONDS  of draining (60)
# Wants deploy/install-deps.sh. The gap says something on a quiet machine only.
# Exit: 0 all is met; 1 something is not; 2 usage; 77 this host cannot run it.
set -euo pipefail
usage() { sed -n '2,/^set -/s/^# \{0,1\}//p' "$0"; }
refuse() { echo "balance.sh: $1" >&2; usage >&2; exit 2; }
case ${1:-} in
  --help) usage; exit 0 ;;
  -*) refuse "unknown argument: $1" ;;
esac
[ $# -le 2 ] || refuse "too many arguments: $*"
here=$(cd "$(dirname "$0")/.." && pwd)
build=${1:-$here/build/release}
seconds=${2:-60}
[[ $seconds =~ ^[1-9][0-9]*$ ]] || refuse "not a number of seconds: $seconds"
[ -x "$build/tests/e2e_balance_test" ] || refuse "not built: $build/tests/e2e_balance_test"
command -v radosgw >/dev/null || { echo "balance.sh: this host has no radosgw" >&2; exit 77; }

work=$(mktemp -d)
trap '"$here/tests/ceph.sh" stop "$work/ceph" || true; rm -rf "$work"' EXIT
"$here/tests/ceph.sh" start "$work/ceph"
export LIQUIDBLEND_E2E_TIER=shared LIQUIDBLEND_CEPH=$work/ceph LIQUIDBLEND_BALANCE_SECONDS=$seconds
"$build/tests/e2e_balance_test" 2>"$work/log" || { tail -n 20 "$work/log" >&2; exit 1; }
