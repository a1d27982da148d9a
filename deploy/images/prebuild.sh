#!/usr/bin/env bash
# Compiles what the images hold into DIRECTORY/bin and DIRECTORY/tests, without debug information.
#   deploy/images/prebuild.sh [DIRECTORY]    default build/prebuilt, from build/release
# Runs in the images' build stage as well. JOBS: compilers at a time.
set -euo pipefail
cd "$(dirname "$0")/../.."
out=${1:-build/prebuilt}
programs=(liquidblend liquidblend-admin liquidblend-server liquidblend-worker)
tests=(e2e_whole_way_test steady_client)

export CCACHE_BASEDIR=${CCACHE_BASEDIR:-$PWD} CCACHE_NOHASHDIR=1
cmake -S . -B build/release -G Ninja -DCMAKE_BUILD_TYPE=Release >/dev/null
ninja -C build/release -j "${JOBS:-$(nproc)}" "${programs[@]}" "${tests[@]}"
rm -rf "$out"
install -d "$out/bin" "$out/tests"
install --strip "${programs[@]/#/build/release/bin/}" "$out/bin"
install --strip "${tests[@]/#/build/release/tests/}" "$out/tests"
