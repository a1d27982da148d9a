#!/usr/bin/env bash
# The e2e tests of the service that deploy/kubernetes/overlays/many-machines describes: podman plays
# the rendered pods (two servers, a worker of each class), and those of the small PostgreSQL and S3
# for trials. Their addresses, images and secrets are named as an operator names them.
#   tests/kubernetes.sh [--prebuilt]
#     --prebuilt    put the programs of build/release into the images instead of compiling there
# Needs root, deploy/install-deps.sh --containers, and that podman has no pod of that service. BASE:
# the base image; made if not given. Cleans up what it started; images stay for the next run.
# Exit: 0 all is well; 1 something is not; 2 usage; 77 this host cannot run containers.
set -Eeuo pipefail
usage() { sed -n '2,/^set -/s/^# \{0,1\}//p' "$0"; }
refuse() { echo "kubernetes.sh: $1" >&2; usage >&2; exit 2; }

prebuilt=0
for argument in "$@"; do
  case $argument in
    --prebuilt) prebuilt=1 ;;
    --help) usage; exit 0 ;;
    *) refuse "unknown argument: $argument" ;;
  esac
done

cd "$(dirname "$0")/.."
. tests/containers/stack.sh
. tests/containers/phases.sh
. tests/containers/kubernetes.sh

trap 'show_failure "$BASH_COMMAND"' ERR
trap clean_up EXIT
trap 'exit 130' INT TERM

phase "host can run containers" check_host
phase "nothing of it is there" check_names
phase "images" build_kube_images
phase "PostgreSQL and S3" play_stores
phase "servers and workers" play_many_machines
phase "pods are confined" check_confined
phase "e2e tests" run_kube_e2e
