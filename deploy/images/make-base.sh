#!/usr/bin/env bash
# Makes the base image of Debian 12 from Debian's own archive, where no registry can be reached.
#   deploy/images/make-base.sh [NAME]     default localhost/liquidblend-base:12; a minute
# Needs root, podman and mmdebstrap (deploy/install-deps.sh --containers).
set -euo pipefail
usage() { sed -n '2,/^set -/s/^# \{0,1\}//p' "$0"; }
refuse() { echo "make-base.sh: $1" >&2; usage >&2; exit 2; }
case ${1:-} in
  --help) usage; exit 0 ;;
  -*) refuse "unknown argument: $1" ;;
esac
[ $# -le 1 ] || refuse "unknown argument: $2"
name=${1:-localhost/liquidblend-base:12}
file=$(mktemp --suffix=.tar)
trap 'rm -f "$file"' EXIT

skip=()
for directory in doc man info locale lintian; do
  skip+=(--dpkgopt="path-exclude=/usr/share/$directory/*")
done
skip+=(--dpkgopt="path-include=/usr/share/doc/*/copyright")  # licences stay, for lists of what is there
mmdebstrap --quiet --variant=apt "${skip[@]}" bookworm "$file"
# As Debian's own image has it: podman kube play sets no path of its own.
podman import --quiet --change ENV=PATH=/usr/local/sbin:/usr/local/bin:/usr/sbin:/usr/bin:/sbin:/bin \
  "$file" "$name" >/dev/null
echo "$name"
