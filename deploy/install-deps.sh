#!/usr/bin/env bash
# Installs every Debian 12 package that building, testing and measuring liquidblend needs.
# Run again at any time: what is there stays as it is.
#   deploy/install-deps.sh               everything
#   deploy/install-deps.sh --build       only what compiling needs
#   deploy/install-deps.sh --quickstart  what compiling needs, and a browser for a picture of the page
#   deploy/install-deps.sh --containers  everything, and what tests/containers.sh needs
#   deploy/install-deps.sh --packages    everything, and what deploy/packages/build.sh needs
#   deploy/install-deps.sh --farm        everything, and the Slurm of tests/farm.sh
#   deploy/install-deps.sh --cache       everything, and nginx for tests/cache_in_front.sh
#   deploy/install-deps.sh --vtk         everything, and VTK for the benchmark against it
#   deploy/install-deps.sh --blender     everything, and Blender for the tests of its add-on
#   deploy/install-deps.sh [..] --list   only prints the packages
set -euo pipefail
usage() { sed -n '2,/^set -/s/^# \{0,1\}//p' "$0"; }
refuse() { echo "install-deps.sh: $1" >&2; usage >&2; exit 2; }

build=(
  # compilers and tools
  g++ cmake ninja-build ccache lld pkg-config
  # libraries
  libgrpc++-dev protobuf-compiler protobuf-compiler-grpc libprotobuf-dev libabsl-dev libeigen3-dev
  libnanoflann-dev libtbb-dev libdraco-dev libsqlite3-dev libxxhash-dev libspdlog-dev libcli11-dev
  nlohmann-json3-dev zlib1g-dev libstb-dev libembree-dev libopenvdb-dev libblosc-dev
  libboost-dev libqhull-dev libhwy-dev libpqxx-dev libpq-dev libcurl4-openssl-dev libssl-dev
  libpugixml-dev libarchive-dev libmeshoptimizer-dev
  prometheus-cpp-dev libjemalloc-dev
  # tests and benchmarks
  libgtest-dev libgmock-dev libbenchmark-dev
)
tools=(
  clang clang-tidy clang-format libclang-rt-14-dev git
  # what pages of docs/ use, which a test runs
  make python3 python3-grpcio python3-protobuf python3-websockets
  # what the check of the farm's templates reads them with
  python3-yaml
  # client/examples/splash, and a display without a graphics card that its test draws on
  libglfw3-dev libepoxy-dev xvfb libgl1-mesa-dri
  # what tests of the Python package use
  python3-numpy python3-pip python3-setuptools python3-venv python3-wheel mypy
  # a database and an object store of the tests' own
  postgresql-15 ceph-mon ceph-osd ceph-mgr ceph-common radosgw curl
  # tests of deploy/monitoring; where Debian starts Prometheus' own service, tests do without it
  prometheus openssl
)
# npm brings Google's API definitions and builds the page. Unless it is there: that of others than
# Debian is one package.
command -v node >/dev/null || build+=(nodejs)
command -v npm >/dev/null || build+=(npm)
# Renders deploy/kubernetes for its tests; likewise.
command -v kubectl >/dev/null || tools+=(kubernetes-client)
browser=(chromium)
containers=(
  podman buildah runc mmdebstrap netavark aardvark-dns catatonit podman-compose iptables systemd
)
packaging=(dpkg-dev file help2man lintian)
farm=(slurm-wlm slurm-client slurmctld slurmd munge)

packages=("${build[@]}")
more=("${tools[@]}" "${browser[@]}")
list=0
for argument in "$@"; do
  case $argument in
    --cache) packages+=(nginx) ;;
    --vtk) packages+=(libvtk9-dev) ;;
    --blender) packages+=(blender) ;;
    --build) more=() ;;
    --quickstart) more=("${browser[@]}") ;;
    --containers) packages+=("${containers[@]}") ;;
    --packages) packages+=("${packaging[@]}") ;;
    --farm) packages+=("${farm[@]}") ;;
    --list) list=1 ;;
    --help) usage; exit 0 ;;
    *) refuse "unknown argument: $argument" ;;
  esac
done
packages+=("${more[@]}")
if [ $list = 1 ]; then
  printf '%s\n' "${packages[@]}"
  exit 0
fi

# Fetches what the package-lock.json of a folder pins; nothing if it is there already.
fetch_from_npm() {
  local folder=$1 have=$1/node_modules/.package-lock.json
  if [ "$have" -nt "$folder/package-lock.json" ]; then return 0; fi
  (cd "$folder" && npm ci --ignore-scripts --no-audit --no-fund --loglevel=error)
}

install_npm_packages() {
  local root
  root=$(dirname "${BASH_SOURCE[0]}")/..
  if ! fetch_from_npm "$root/proto"; then
    echo "install-deps: npm cannot fetch Google's API definitions (proto/package.json);" \
      "cmake -DLIQUIDBLEND_GOOGLE_PROTOS=FOLDER takes them from a folder" >&2
  fi
  if ! fetch_from_npm "$root/client/web"; then
    echo "install-deps: npm cannot fetch what the page is made of (client/web/package.json);" \
      "it is left out of the server" >&2
  fi
  if [ "${#more[@]}" -eq 0 ]; then return 0; fi
  if ! fetch_from_npm "$root/tests/e2e/web"; then
    echo "install-deps: npm cannot fetch playwright-core; tests of the page are left out" >&2
  fi
  if [ "${#more[@]}" -eq "${#browser[@]}" ]; then return 0; fi
  if ! fetch_from_npm "$root/tests/server/encode/wasm"; then
    echo "install-deps: npm cannot fetch draco3d; wasm_decoder_test.cc is left out" >&2
  fi
  if ! fetch_from_npm "$root/tests/kubernetes"; then
    echo "install-deps: npm cannot fetch kubernetes-models; tests of deploy/kubernetes are left out" >&2
  fi
}

missing=()
for package in "${packages[@]}"; do
  dpkg-query -W -f='${Status}' "$package" 2>/dev/null | grep -q 'ok installed' || missing+=("$package")
done
if [ ${#missing[@]} -eq 0 ]; then
  echo "install-deps: all ${#packages[@]} packages are installed"
  install_npm_packages
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
# Debian starts Prometheus on all addresses. The tests start their own.
if [[ " ${missing[*]} " == *" prometheus "* ]] && [ -d /run/systemd/system ]; then
  "${as_root[@]}" systemctl disable --now prometheus
fi
install_npm_packages
