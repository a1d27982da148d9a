#!/usr/bin/env bash
# The Debian packages as a user meets them: in a fresh container of Debian 12 in which systemd runs
# they are installed, the bundled pair is registered, and a frame of it is checked: within three
# minutes, without a compiler. Then the workers' unit, the Python package, headers for programs, a
# reinstallation, an upgrade from an older version, removal and purging.
#   tests/packages.sh [--built]
#     --built  the packages of build/packages as they are; otherwise they are built first
# Needs root, deploy/install-deps.sh --containers --packages, and Debian's archive by network. BASE:
# the base image; made if not given.
# Ends with a table of the phases that have passed. Cleans up what it started, also after Ctrl-C.
# Exit: 0 all is well; 1 something is not; 2 usage; 77 this host cannot run containers.
set -Eeuo pipefail
usage() { sed -n '2,/^set -/s/^# \{0,1\}//p' "$0"; }
refuse() { echo "packages.sh: $1" >&2; usage >&2; exit 2; }

built=0
for argument in "$@"; do
  case $argument in
    --built) built=1 ;;
    --help) usage; exit 0 ;;
    *) refuse "unknown argument: $argument" ;;
  esac
done

cd "$(dirname "$0")/.."
. tests/containers/common.sh
. tests/packages/machine.sh
. tests/packages/phases.sh

trap 'show_failure "$BASH_COMMAND"' ERR
trap clean_up EXIT
trap 'exit 130' INT TERM

phase "host can run containers" check_host
phase "packages are there and what they should be" check_packages
phase "container with systemd" make_machine_image
phase "install, register the bundled pair, one frame" install_and_play
phase "what is installed: no compiler, units, user, ports" check_machine
phase "more workers by their unit" start_workers
phase "Python package" use_python
phase "headers: a program is built and runs" build_program
phase "reinstalled: changed configuration stays" reinstall
phase "upgrade from an older version" upgrade
phase "remove: data stay; purge: they go" remove_and_purge
