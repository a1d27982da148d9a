#!/usr/bin/env bash
# Workers as tasks of a farm (docs/operations/farms.md), on a real Slurm, PostgreSQL and S3 of this
# script's own, on this machine:
#   - an array of four tasks finishes eight registrations, and every task ends with status 0;
#   - tasks are preempted in mid-job, at once and after a time of grace, and reach the end of their
#     time: each goes on after its last checkpoint, and at most MAX_LOST_S of work is lost;
#   - the templates for OpenCue and OpenJD start workers that do jobs (without these programs);
#   - twenty workers, one after another, get SIGTERM at a random moment of one registration.
# The families must have the bytes of those of a worker that nothing happens to.
#   tests/farm.sh [BUILD_DIRECTORY] [PHASE ..]    build/release and all phases unless given
# Phases: array preemption time templates twenty. Needs root, deploy/install-deps.sh --farm, a build
# of liquidblend, liquidblend-server and liquidblend-worker; takes about 15 minutes on two cores.
# SEED: of the random moments, printed. MAX_LOST_S: 10; an iteration must take less. SPACING: of the
# meshes, 0.9; a coarser one makes all faster. Cleans up what it started.
# Exit: 0 all is well; 1 something is not; 2 usage; 77 this host cannot run a Slurm.
set -Eeuo pipefail
usage() { sed -n '2,/^set -/s/^# \{0,1\}//p' "$0"; }
refuse() { echo "farm.sh: $1" >&2; usage >&2; exit 2; }

build=build/release
all_phases=(array preemption time templates twenty)
wanted=()
for argument in "$@"; do
  case $argument in
    --help) usage; exit 0 ;;
    -*) refuse "unknown argument: $argument" ;;
    array | preemption | time | templates | twenty) wanted+=("$argument") ;;
    *) build=$argument ;;
  esac
done
[ ${#wanted[@]} -gt 0 ] || wanted=("${all_phases[@]}")
cd "$(dirname "$0")/.."
bin=$(cd "$build" 2>/dev/null && pwd)/bin
. tests/farm/stack.sh
. tests/farm/phases.sh

trap 'show_failure "$BASH_COMMAND"' ERR
trap clean_up EXIT
trap 'exit 130' INT TERM

phase "host can run a farm" check_host
phase "stores, server, Slurm" start_stack
phase "scene" import_scene
for name in "${wanted[@]}"; do
  case $name in
    array) phase "array of four, eight registrations" run_array ;;
    preemption)
      phase "preempted at once" preempt farm
      phase "preempted after a time of grace" preempt graceful
      ;;
    time) phase "end of a task's time" end_time ;;
    templates)
      phase "OpenCue's command" run_opencue_frames
      phase "OpenJD's action" run_openjd_tasks
      ;;
    twenty) phase "twenty times SIGTERM" end_twenty_workers ;;
  esac
done
