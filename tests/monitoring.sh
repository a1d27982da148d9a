#!/usr/bin/env bash
# Rules, dashboards and alerts of deploy/monitoring with real programs: whether every panel has
# data, and whether each alert fires and clears by a fault that is made and mended.
#   tests/monitoring.sh [--no-build]
#     --no-build  uses the programs of build/release as they are
# Exit: 0 if all is well; 1 if not; 2 usage; 77 Prometheus is missing.
set -euo pipefail
usage() { sed -n '2,/^set -/s/^# \{0,1\}//p' "$0"; }
refuse() { echo "monitoring.sh: $1" >&2; usage >&2; exit 2; }

build=1
for argument in "$@"; do
  case $argument in
    --no-build) build=0 ;;
    --help) usage; exit 0 ;;
    *) refuse "unknown argument: $argument" ;;
  esac
done
cd "$(dirname "$0")/.."
for program in prometheus promtool; do
  command -v "$program" >/dev/null || {
    echo "monitoring.sh: no $program: run deploy/install-deps.sh" >&2
    exit 77
  }
done

if [ $build = 1 ]; then
  export CCACHE_BASEDIR=$PWD CCACHE_NOHASHDIR=1
  cmake --preset release >/dev/null
  cmake --build --preset release -j "$(nproc)" --target fake_s3 liquidblend liquidblend-server \
    liquidblend-worker
fi
tests/monitoring/rules.sh
tests/monitoring/check_files.py .
tests/monitoring/panels_test.py build/release
tests/monitoring/alerts_test.py build/release
