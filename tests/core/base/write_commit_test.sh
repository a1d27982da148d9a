#!/usr/bin/env bash
# Tests core/base/write_commit.cmake: which commit a program is told, and that an unchanged one
# leaves its source alone.
#   write_commit_test.sh FOLDER_OF_THE_SCRIPT
# Exit: 0 if all holds; 1 if not, with a line that says what; 2 usage.
set -euo pipefail
usage() { sed -n '2,/^set -/s/^# \{0,1\}//p' "$0"; }
refuse() { echo "write_commit_test.sh: $1" >&2; usage >&2; exit 2; }
if [ "${1:-}" = --help ]; then usage; exit 0; fi
[[ ${1:-} != -* ]] || refuse "unknown argument: $1"
[ $# = 1 ] || refuse "one argument is needed"
scripts=$(realpath "$1")
directory=$(mktemp -d)
trap 'rm -rf "$directory"' EXIT
unset LIQUIDBLEND_COMMIT GIT_DIR GIT_WORK_TREE GIT_INDEX_FILE
output=$directory/commit.cc
sources=$directory/outer/sources

fail() { echo "write_commit_test.sh: $1" >&2; exit 1; }
write_commit() {
  cmake -DSOURCE_DIR="$sources" -DTEMPLATE="$scripts/commit.cc.in" -DOUTPUT="$output" \
    -P "$scripts/write_commit.cmake"
}
commit() { sed -n 's/^const char kCommit\[\] = "\(.*\)";$/\1/p' "$output"; }
expect() {  # WHAT PATTERN
  write_commit
  [[ $(commit) =~ ^$2$ ]] || fail "$1: '$(commit)' is not $2"
}
in_git() { git -C "$1" -c user.name=a -c user.email=a@b -c commit.gpgsign=false "${@:2}" >/dev/null; }

# An archive of the sources, unpacked in the repository of another project.
mkdir -p "$sources"
echo 1 >"$sources/file"
in_git "$directory/outer" init -b main
in_git "$directory/outer" add .
in_git "$directory/outer" commit -m outer
expect "without a repository" unknown
LIQUIDBLEND_COMMIT=0123456789ab expect "of the environment" 0123456789ab

in_git "$sources" init -b main
in_git "$sources" add .
in_git "$sources" commit -m first
expect "of a commit" '[0-9a-f]{12}'
first=$(commit)
touch -d '2 hours ago' "$output"
before=$(stat -c %Y "$output")
write_commit
[ "$(stat -c %Y "$output")" = "$before" ] || fail "the same commit was written again"

echo 2 >"$sources/file"
expect "of changed files" "$first-dirty"
in_git "$sources" tag v1
expect "beside a tag" "$first-dirty"
in_git "$sources" commit -am second
expect "of the next commit" '[0-9a-f]{12}'
[ "$(commit)" != "$first" ] || fail "two commits are the same"
LIQUIDBLEND_COMMIT=fedcba987654 expect "of the environment, in a repository" fedcba987654
if LIQUIDBLEND_COMMIT='a"b' write_commit 2>/dev/null; then fail "a quote was written"; fi
