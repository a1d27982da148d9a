#!/usr/bin/env bash
# Simulates the scenes that nothing was tuned for, each with its truth, for tests/accuracy/run.sh.
# Named as SCENE, `throw` is made with the truths of the scene throw_family, at 20 and 40 degrees.
# What is there already stays. Takes some 10 minutes on two cores.
#   tests/data/bake_scenes.sh FOLDER [SCENE ...]
# Needs Blender 3.4: apt-get install blender.
set -euo pipefail
usage() { sed -n '2,/^set -/s/^# \{0,1\}//p' "$0"; }
refuse() { echo "bake_scenes.sh: $1" >&2; usage >&2; exit 2; }
case ${1:-} in
  --help) usage; exit 0 ;;
  '') refuse "no FOLDER given" ;;
  -*) refuse "unknown argument: $1" ;;
esac
simulate=$(cd "$(dirname "$0")" && pwd)/simulate.py
folder=$1
shift
[ $# -gt 0 ] || set -- far_drop crossing_drops drop_size block_length inflow_start moving_obstacle \
  touching_drops
mkdir -p "$folder"
for scene in "$@"; do
  names=(A MID B)
  [ "$scene" != throw ] || names+=(at_20 at_40)
  for name in "${names[@]}"; do
    out=$folder/$scene/$name
    [ ! -f "$out/meta.json" ] || continue
    echo "$scene $name"
    blender -b --factory-startup --python-exit-code 1 --python "$simulate" -- "$scene" "$name" \
      --out "$out" >"$folder/bake.log" 2>&1 ||
      { tail -n 20 "$folder/bake.log" >&2; echo "bake_scenes.sh: $scene $name failed" >&2; exit 1; }
  done
done
