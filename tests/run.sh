#!/usr/bin/env bash
# Installs what is missing, builds the release and runs all of its tests.
#   tests/run.sh [--no-install] [--all]
#   --all         first the programs of unit tests with AddressSanitizer and
#                 UndefinedBehaviorSanitizer, without the tests of tests/slow_with_sanitizers.txt
#   --no-install  installs no packages
set -euo pipefail
usage() { sed -n '2,/^set -/s/^# \{0,1\}//p' "$0"; }
refuse() { echo "run.sh: $1" >&2; usage >&2; exit 2; }

install=1
sanitize=0
for argument in "$@"; do
  case $argument in
    --no-install) install=0 ;;
    --all) sanitize=1 ;;
    --help) usage; exit 0 ;;
    *) refuse "unknown argument: $argument" ;;
  esac
done
cd "$(dirname "$0")/.."

# step WHAT: says what begins, and after how many minutes and seconds.
step() { printf '== %d:%02d %s\n' $((SECONDS / 60)) $((SECONDS % 60)) "$1"; }

[ "$install" = 0 ] || deploy/install-deps.sh
jobs=$(nproc)
slots=$((2 * jobs))  # a test counts as one or two: tests/CMakeLists.txt
export CCACHE_BASEDIR=$PWD CCACHE_NOHASHDIR=1  # another clone of the same sources hits the cache

if [ "$sanitize" = 1 ]; then
  step "compile with sanitizers"
  cmake --preset asan >/dev/null
  cmake --build --preset asan -j "$jobs" --target lb_unit_tests
  step "unit tests with sanitizers"
  ctest --preset asan-programs -j "$slots"
fi

step "compile"
cmake --preset release >/dev/null
cmake --build --preset release -j "$jobs"
step "tests"
ctest --preset release -j "$slots"
