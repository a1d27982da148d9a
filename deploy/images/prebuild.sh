#!/usr/bin/env bash
# Compiles what the images hold into DIRECTORY/bin and DIRECTORY/tests, without debug information.
#   deploy/images/prebuild.sh [DIRECTORY]    default build/prebuilt, from build/release
# Both are replaced. A DIRECTORY that holds anything else is refused.
# Runs in the images' build stage as well. JOBS: compilers at a time.
set -euo pipefail
usage() { sed -n '2,/^set -/s/^# \{0,1\}//p' "$0"; }
refuse() { echo "prebuild.sh: $1" >&2; usage >&2; exit 2; }
case ${1:-} in
  --help) usage; exit 0 ;;
  -*) refuse "unknown argument: $1" ;;
esac
[ $# -le 1 ] || refuse "unknown argument: $2"
cd "$(dirname "$0")/../.."
out=${1:-build/prebuilt}
programs=(liquidblend liquidblend-admin liquidblend-server liquidblend-worker)

# By their names: what this script or an older one has made, whole or in part.
made='\./(bin(/liquidblend[a-z_-]*(\.so)?)?|tests(/(e2e_[a-z0-9_]*(\.txt)?|liblb_[a-z_]*\.so|steady_client|suite\.sh))?)'
if [ -e "$out" ]; then
  other=$(cd "$out" && find . -mindepth 1 -regextype posix-extended ! -regex "$made" -print -quit)
  [ -z "$other" ] || refuse "$out holds ${other#./}, which is not made here: name another folder"
fi

export CCACHE_BASEDIR=${CCACHE_BASEDIR:-$PWD} CCACHE_NOHASHDIR=1
cmake -S . -B build/release -G Ninja -DCMAKE_BUILD_TYPE=Release >/dev/null
ninja -C build/release -j "${JOBS:-$(nproc)}" "${programs[@]}" lb_e2e_tests
rm -rf "${out:?}/bin" "$out/tests"
install -d "$out/bin"
install --strip "${programs[@]/#/build/release/bin/}" build/release/bin/liquidblend_vdb.so "$out/bin"
# The tests that tests/e2e/CMakeLists.txt names, their list, and who runs it.
cmake --install build/release --component e2e --strip --prefix "$out" >/dev/null
