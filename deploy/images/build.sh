#!/usr/bin/env bash
# Builds images of these sources with podman, labelled by version, commit and time, and lists what
# is in each (SPDX).
#   deploy/images/build.sh [--prebuilt] [--tag TAG]... [TARGET..]
#   TARGET      of deploy/Containerfile; server, worker and client unless given
#   --prebuilt  put programs of build/release into the images instead of compiling there
#   --tag TAG   localhost/liquidblend-TARGET:TAG; the version and `latest` unless given
#   BASE, JOBS, NODE_EXTRA_CA_CERTS: as in deploy/Containerfile
# Leaves the lists in build/images: liquidblend-TARGET.spdx.json.
set -euo pipefail
usage() { sed -n '2,/^set -/s/^# \{0,1\}//p' "$0"; }
refuse() { echo "build.sh: $1" >&2; usage >&2; exit 2; }
from=
tags=()
targets=()
while [ $# -gt 0 ]; do
  case $1 in
    --prebuilt) from=build/prebuilt ;;
    --tag) [ $# -gt 1 ] || refuse "--tag: no TAG given"; tags+=("$2"); shift ;;
    --help) usage; exit 0 ;;
    -*) refuse "unknown argument: $1" ;;
    *) targets+=("$1") ;;
  esac
  shift
done
cd "$(dirname "$0")/../.."
version=$(sed -n 's/^project(liquidblend VERSION \([0-9.]*\).*/\1/p' CMakeLists.txt)
[ ${#targets[@]} -gt 0 ] || targets=(server worker client)
[ ${#tags[@]} -gt 0 ] || tags=("$version" latest)

epoch=$(git log -1 --format=%ct 2>/dev/null || date +%s)
export SOURCE_DATE_EPOCH=${SOURCE_DATE_EPOCH:-$epoch}
commit=$(git describe --always --dirty --abbrev=12 --exclude='*' 2>/dev/null || echo unknown)
arguments=(--build-arg "COMMIT=$commit" --build-arg "PREBUILT=$from")
[ -z "${BASE:-}" ] || arguments+=(--build-arg "BASE=$BASE")
[ -z "${JOBS:-}" ] || arguments+=(--build-arg "JOBS=$JOBS")
# npm trusts the authorities there that it trusts here.
[ -z "${NODE_EXTRA_CA_CERTS:-}" ] ||
  arguments+=(--volume "$NODE_EXTRA_CA_CERTS:/ca.crt:ro" --build-arg NODE_EXTRA_CA_CERTS=/ca.crt)
scratch=$(mktemp -d)
trap 'rm -rf "$scratch"' EXIT

# build TARGET
build() {
  local name=localhost/liquidblend-$1 tag labels=()
  case $1 in
    postgres | s3) ;;  # of others' programs
    *) labels=(--build-arg "VERSION=$version"
      --build-arg "CREATED=$(date --utc --date="@$SOURCE_DATE_EPOCH" +%FT%TZ)") ;;
  esac
  podman build --quiet --format docker --network host "${arguments[@]}" "${labels[@]}" \
    --target "$1" --tag "$name:${tags[0]}" --file deploy/Containerfile . >/dev/null
  for tag in "${tags[@]:1}"; do podman tag "$name:${tags[0]}" "$name:$tag"; done
}

# list TARGET
list() {
  local name=liquidblend-$1 npm=() root=$scratch/$1
  case $1 in
    server | e2e) npm=(--npm client/web/package-lock.json --npm proto/package-lock.json:google-proto-files) ;;
    worker | client) npm=(--npm proto/package-lock.json:google-proto-files) ;;
  esac
  mkdir "$root"
  # Links between folders of documentation are followed, as they would lead out of the copy.
  podman run --rm --no-healthcheck --network none --user root --entrypoint sh \
    "localhost/$name:${tags[0]}" -c 'cd /
      { echo var/lib/dpkg/status; find -L usr/share/doc -name copyright; } | tar -ch -T -' |
    tar -x -C "$root"
  deploy/packages/sbom.py image "$name" "$version" "build/images/$name.spdx.json" --root "$root" \
    "${npm[@]}"
}

[ -z "$from" ] || LIQUIDBLEND_COMMIT=$commit deploy/images/prebuild.sh $from
mkdir -p build/images
for target in "${targets[@]}"; do
  build "$target"
  list "$target"
done
podman images --filter "reference=localhost/liquidblend-*:${tags[0]}" \
  --format '{{.Repository}}:{{.Tag}} {{.Size}}' | sed 's|localhost/||'
