#!/usr/bin/env bash
# Makes a manual page for each program and each of its commands from their --help.
#   deploy/packages/man_pages.sh PROGRAMS OUT VERSION
# Writes OUT/{client,server,worker}/*.1.gz. Needs help2man; the same programs give the same bytes if
# SOURCE_DATE_EPOCH is set.
set -euo pipefail
usage() { sed -n '2,/^set -/s/^# \{0,1\}//p' "$0"; }
refuse() { echo "man_pages.sh: $1" >&2; usage >&2; exit 2; }
case ${1:-} in
  --help) usage; exit 0 ;;
  -*) refuse "unknown argument: $1" ;;
esac
[ $# = 3 ] || refuse "three arguments are wanted"
programs=$1 out=$2 version=$3

# help_of PROGRAM [COMMAND]; in the form that help2man reads. Without the folder of the program.
help_of() { "$programs/$1" "${@:2}" --help | sed "s|$programs/||"; }
commands_of() { help_of "$1" | sed -n '/^Subcommands:/,/^$/s/^  \([a-z-]\{1,\}\) .*/\1/p'; }

# page FOLDER PROGRAM [COMMAND]
page() {
  local folder=$out/$1 name
  shift
  name=$(tr ' ' - <<<"$*")
  help2man --no-info --manual=liquidblend --source="liquidblend $version" \
    --version-string="$name $version" --name="$(help_of "$@" | sed -n 1p)" \
    --help-option="${*:2} --help" "$programs/$1" |
    sed "s|$programs/||; 0,/^\.TH/s/^\.TH [^ ]*/.TH ${name^^}/" | gzip -9n >"$folder/$name.1.gz"
}

rm -rf "$out"
mkdir -p "$out"/{client,server,worker}
page worker liquidblend-worker
page server liquidblend-server
for program in client/liquidblend server/liquidblend-admin; do
  folder=${program%/*} program=${program#*/}
  page "$folder" "$program"
  for command in $(commands_of "$program"); do page "$folder" "$program" "$command"; done
done
