#!/usr/bin/env bash
# Installs every Debian 12 package that building, testing and measuring liquidblend needs.
# Run again at any time: what is there stays as it is.
#   deploy/install-deps.sh            everything
#   deploy/install-deps.sh --list     only prints the packages
set -euo pipefail

packages=(
  # compilers and tools
  g++ clang clang-tidy clang-format libclang-rt-14-dev cmake ninja-build ccache pkg-config git python3
  # libraries
  libgrpc++-dev protobuf-compiler protobuf-compiler-grpc libprotobuf-dev libabsl-dev libeigen3-dev
  libnanoflann-dev libtbb-dev libdraco-dev libsqlite3-dev libxxhash-dev libspdlog-dev libcli11-dev
  nlohmann-json3-dev zlib1g-dev libstb-dev libembree-dev libopenvdb-dev libblosc-dev
  libboost-dev libqhull-dev
  # tests and benchmarks
  libgtest-dev libgmock-dev libbenchmark-dev
)

if [ "${1:-}" = "--list" ]; then
  printf '%s\n' "${packages[@]}"
  exit 0
fi

missing=()
for package in "${packages[@]}"; do
  dpkg-query -W -f='${Status}' "$package" 2>/dev/null | grep -q 'ok installed' || missing+=("$package")
done
if [ ${#missing[@]} -eq 0 ]; then
  echo "install-deps: all ${#packages[@]} packages are installed"
  exit 0
fi

. /etc/os-release
if [ "${ID:-}" != debian ] || [ "${VERSION_ID:-}" != 12 ]; then
  echo "install-deps: made for Debian 12, this is ${PRETTY_NAME:-unknown}; trying anyway" >&2
fi
as_root=()
if [ "$(id -u)" != 0 ]; then
  command -v sudo >/dev/null || { echo "install-deps: run as root, or install sudo; missing: ${missing[*]}" >&2; exit 1; }
  as_root=(sudo)
fi
echo "install-deps: installing ${missing[*]}"
"${as_root[@]}" apt-get update -q
"${as_root[@]}" env DEBIAN_FRONTEND=noninteractive apt-get install -q -y --no-install-recommends "${missing[@]}"
