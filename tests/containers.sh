#!/usr/bin/env bash
# The service as it runs on many machines, in containers: two servers, two workers, PostgreSQL and
# S3 on a network of their own. The e2e tests: of this service, and, in a container of their own, of
# programs that they start there, on both tiers. Containers killed, cut off and replaced by a new
# image in the middle of work: nothing that was accepted may be lost, frames must stay the same to
# the byte, and no request of a client that knows both servers may fail.
#   tests/containers.sh [--prebuilt] [--no-compose]
#     --prebuilt    put the programs of build/release into the images instead of compiling there
#     --no-compose  without the compose files
# Needs root and deploy/install-deps.sh --containers. BASE: the base image; made if not given.
# Ends with a table of the phases that have passed. Cleans up what it started, also after Ctrl-C;
# images stay for the next run.
# Exit: 0 all is well; 1 something is not; 2 usage; 77 this host cannot run containers.
set -Eeuo pipefail
usage() { sed -n '2,/^set -/s/^# \{0,1\}//p' "$0"; }
refuse() { echo "containers.sh: $1" >&2; usage >&2; exit 2; }

prebuilt=0
compose=1
for argument in "$@"; do
  case $argument in
    --prebuilt) prebuilt=1 ;;
    --no-compose) compose=0 ;;
    --help) usage; exit 0 ;;
    *) refuse "unknown argument: $argument" ;;
  esac
done

cd "$(dirname "$0")/.."
. tests/containers/stack.sh
. tests/containers/phases.sh
. tests/containers/compose.sh

trap 'show_failure "$BASH_COMMAND"' ERR
trap clean_up EXIT
trap 'exit 130' INT TERM

phase "host can run containers" check_host
phase "images" build_images
phase "e2e tests in a container: embedded" run_embedded_suite
phase "e2e tests in a container: faults" run_faults_suite
phase "start" start_stack
phase "e2e tests of the stack" run_e2e
phase "e2e tests in a container: shared" run_shared_suite
phase "scene: import, register" make_scene
phase "worker killed" kill_worker
phase "server killed" kill_server
phase "PostgreSQL killed" kill_postgres
phase "worker cut off" cut_off_worker
phase "roll to a new image" roll
phase "metrics" read_metrics
phase "nothing lost" check_nothing_lost
if [ $compose = 1 ]; then
  phase "compose: one machine" compose_embedded
  phase "compose: one machine, TLS" compose_tls
  phase "compose: many machines" compose_scale_out
fi
phase "systemd units" check_units
