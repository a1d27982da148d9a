#!/usr/bin/env bash
# Installs what is missing, builds, and runs every test: the release build with all tests, then the
# unit tests again under AddressSanitizer and UndefinedBehaviorSanitizer.
#   tests/run.sh [--no-install] [--no-asan]
set -euo pipefail
cd "$(dirname "$0")/.."

install=1
asan=1
for argument in "$@"; do
  case $argument in
    --no-install) install=0 ;;
    --no-asan) asan=0 ;;
    *) echo "usage: tests/run.sh [--no-install] [--no-asan]" >&2; exit 2 ;;
  esac
done

[ "$install" = 0 ] || deploy/install-deps.sh
jobs=$(nproc)
export CCACHE_BASEDIR=$PWD CCACHE_NOHASHDIR=1  # another clone of the same sources hits the cache

if [ "$asan" = 1 ]; then
  cmake --preset asan >/dev/null
  cmake --build --preset asan -j "$jobs" --target lb_unit_tests
  ctest --preset asan -j "$jobs"
fi

cmake --preset release >/dev/null
cmake --build --preset release -j "$jobs"
ctest --preset release -j "$jobs"
