#!/usr/bin/env bash
# Prints the accuracy tables (Markdown): the scenes of the repository, and those of the folder given
# that it has (those below, and those that tests/data/bake_scenes.sh makes; a folder per input
# inside, each a Mantaflow cache with its meta.json). One process a scene, so that its peak memory is
# its own. Seeds are fixed.
#   tests/accuracy/run.sh [DATA_FOLDER] [flags of lb_accuracy, e.g. --iterations 24 --seed 2]
# BUILD names the build folder (default build/release), which must hold the target lb_accuracy.
set -euo pipefail
usage() { sed -n '2,/^set -/s/^# \{0,1\}//p' "$0"; }
if [ "${1:-}" = --help ]; then usage; exit 0; fi
root=$(cd "$(dirname "$0")/../.." && pwd)
program=${BUILD:-$root/build/release}/tests/lb_accuracy
data=$root/tests/data
if [ $# -gt 0 ] && [ "${1#--}" = "$1" ]; then
  data=$1
  shift
fi

failed=0
"$program" --scene falling_drop "$@" || failed=1
"$program" --scene two_drops "$@" || failed=1
for scene in dam_break crown moved_drop two_drops_bridged throw \
  far_drop crossing_drops drop_size block_length inflow_start moving_obstacle touching_drops; do
  [ -d "$data/$scene" ] || continue
  "$program" --scene "$scene" --data "$data" "$@" || failed=1
done
if [ -d "$data/throw/at_20" ]; then
  "$program" --scene throw_family --data "$data" "$@" || failed=1
fi
exit "$failed"
