#!/usr/bin/env bash
# Measures both README commands as a newcomer meets them: in a clean clone of the last commit, with
# an empty compiler cache. Packages that are missing are installed first. Prints a table.
#   tests/cold_build.sh [--warm] [--all]
#   --warm  measures the tests once more in a second clone, which finds the first one's objects
#   --all   runs tests/run.sh --all instead of tests/run.sh
set -euo pipefail
usage() { sed -n '2,/^set -/s/^# \{0,1\}//p' "$0"; }
refuse() { echo "cold_build.sh: $1" >&2; usage >&2; exit 2; }

warm=0
all=()
for argument in "$@"; do
  case $argument in
    --warm) warm=1 ;;
    --all) all=(--all) ;;
    --help) usage; exit 0 ;;
    *) refuse "unknown argument: $argument" ;;
  esac
done
cd "$(dirname "$0")/.."

work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
export CCACHE_DIR=$work/ccache
git clone -q . "$work/first"

rows=()
# add_row WHAT SECONDS STATUS
add_row() { rows+=("$(printf '| %s | %d:%02d | %s |' "$1" $(($2 / 60)) $(($2 % 60)) "$3")"); }
# measure WHAT FOLDER COMMAND..: adds a row with the time that the command took there, and one for
# each step that it prints as tests/run.sh does ("== MINUTES:SECONDS STEP").
measure() {
  local what=$1 folder=$2 begin=$SECONDS status=0
  shift 2
  echo "== $what"
  (cd "$folder" && "$@") >"$work/log" 2>&1 || status=$?
  local took=$((SECONDS - begin))
  add_row "$what" "$took" "$status"
  local at name start step=
  while read -r _ at name; do
    [ -z "$step" ] || add_row "- $step" $((60 * ${at%:*} + 10#${at#*:} - start)) ""
    start=$((60 * ${at%:*} + 10#${at#*:}))
    step=$name
  done < <(grep -E '^== [0-9]+:[0-9]{2} ' "$work/log")
  [ -z "$step" ] || add_row "- $step" $((took - start)) ""
  [ "$status" = 0 ] || { tail -n 30 "$work/log" >&2; failed=1; }
}

failed=0
measure "packages" "$work/first" deploy/install-deps.sh
measure "configure" "$work/first" cmake --preset release
measure "compile what the quick start needs" "$work/first" cmake --build --preset release \
  --target liquidblend liquidblend-admin liquidblend-server liquidblend-worker
measure "\`deploy/quickstart.sh\`, once that is built" "$work/first" deploy/quickstart.sh
rm -rf "$work/first"
git clone -q . "$work/second"
rm -rf "$CCACHE_DIR"
measure "\`tests/run.sh ${all[*]}\`, cold" "$work/second" tests/run.sh "${all[@]}"
if [ "$warm" = 1 ]; then
  rm -rf "$work/second"
  git clone -q . "$work/second"
  measure "\`tests/run.sh ${all[*]}\`, cache warm" "$work/second" tests/run.sh "${all[@]}"
fi

printf '\n%s, %s cores\n\n| what | min:s | exit status |\n| --- | --- | --- |\n' \
  "$(git rev-parse --short HEAD)" "$(nproc)"
printf '%s\n' "${rows[@]}"
exit $failed
