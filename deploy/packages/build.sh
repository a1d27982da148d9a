#!/usr/bin/env bash
# Builds the Debian packages of these sources, checks them, and lists what is in each (SPDX).
#   deploy/packages/build.sh [--no-install] [OUT]    default OUT: build/packages
#   --no-install  installs no packages that building needs
#   JOBS=2        compilers at a time
# Compiles in build/package, with the preset `package`: from nothing 15 minutes on two cores.
# Leaves in OUT: *.deb, *.deb.spdx.json, SHA256SUMS. What was there of these is removed.
set -euo pipefail
usage() { sed -n '2,/^set -/s/^# \{0,1\}//p' "$0"; }
refuse() { echo "build.sh: $1" >&2; usage >&2; exit 2; }
install=1
out=
for argument in "$@"; do
  case $argument in
    --no-install) install=0 ;;
    --help) usage; exit 0 ;;
    -*) refuse "unknown argument: $argument" ;;
    *) [ -z "$out" ] || refuse "one OUT is wanted, not: $*"; out=$argument ;;
  esac
done
cd "$(dirname "$0")/../.."
out=${out:-build/packages}
build=build/package

[ $install = 0 ] || deploy/install-deps.sh --build --packages
for tool in cpack dpkg-shlibdeps help2man lintian; do
  command -v $tool >/dev/null || { echo "build.sh: no $tool; deploy/install-deps.sh --packages" >&2; exit 1; }
done
[ -d client/web/node_modules ] ||
  { echo "build.sh: the page cannot be built; deploy/install-deps.sh --build" >&2; exit 1; }

echo "== compile" >&2
export CCACHE_BASEDIR=${CCACHE_BASEDIR:-$PWD} CCACHE_NOHASHDIR=1
# Files are as old as the commit, if there is one.
SOURCE_DATE_EPOCH=${SOURCE_DATE_EPOCH:-$(git log -1 --format=%ct 2>/dev/null || date +%s)}
export SOURCE_DATE_EPOCH
cmake --preset package >/dev/null
ninja -C $build -j "${JOBS:-$(nproc)}" liquidblend_packages

echo "== pack" >&2
mkdir -p "$out"
out=$(cd "$out" && pwd)
rm -rf "$out"/*.deb "$out"/*.deb.spdx.json "$out"/{SHA256SUMS,_CPack_Packages}
(umask 022 && cd $build && cpack -B "$out" >"$out/cpack.log") || { cat "$out/cpack.log" >&2; exit 1; }
rm -r "$out/_CPack_Packages" "$out/cpack.log"
(cd "$out" && sha256sum -- *.deb >SHA256SUMS)

echo "== check" >&2
lintian --allow-root --fail-on error,warning --tag-display-limit 0 "$out"/*.deb

echo "== list" >&2
google=proto/package-lock.json:google-proto-files
# list PACKAGE [options of sbom.py]
list() {
  local file
  file=$(ls "$out/$1"_*.deb)
  deploy/packages/sbom.py deb "$file" "$file.spdx.json" "${@:2}"
}
list liquidblend-server --build $build --programs bin/liquidblend-{server,admin} \
  --npm client/web/package-lock.json --npm $google
list liquidblend-worker --build $build --programs bin/liquidblend-worker --npm $google
list liquidblend-client --build $build --programs bin/liquidblend{,_vdb.so} --npm $google
list libliquidblend1 --build $build --programs lib/libliquidblend.so.1.0.0 --npm $google
list libliquidblend-dev --build $build --programs client/libliquidblend.a --npm $google
for package in python3-liquidblend liquidblend-{doc,examples}; do list $package; done
ls -l "$out"
