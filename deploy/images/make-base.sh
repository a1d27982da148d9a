#!/usr/bin/env bash
# Makes the base image of Debian 12 from Debian's own archive, where no registry can be reached.
#   deploy/images/make-base.sh [NAME]     default localhost/liquidblend-base:12; a minute
# Needs root, podman and mmdebstrap (deploy/install-deps.sh --containers).
set -euo pipefail
name=${1:-localhost/liquidblend-base:12}
file=$(mktemp --suffix=.tar)
trap 'rm -f "$file"' EXIT

skip=()
for directory in doc man info locale lintian; do
  skip+=(--dpkgopt="path-exclude=/usr/share/$directory/*")
done
mmdebstrap --quiet --variant=apt "${skip[@]}" bookworm "$file"
podman import --quiet "$file" "$name" >/dev/null
echo "$name"
