#!/usr/bin/env bash
# Runs the browser tests of the page, and those of exported files.
# Those of tokens need a server of their own; they run if `token` alone or no test is named.
#   tests/e2e/web/run.sh [--server DIRECTORY] [TEST..]     such as: play scrub; default all
#   --server DIRECTORY   that of `server.sh start DIRECTORY`; without, a server of their own
# BUILD: the build folder (default build/release); LIQUIDBLEND_BINARY_DIR: other programs than its.
# LEAK_FRAMES: how many frames are shown to see whether memory grows (default 300).
# LIQUIDBLEND_E2E_PATIENCE=600: waits longer, where programs are slow (default, and least: 180).
# STRICT_TIMES=1: figures of time count, too; for a machine that does nothing else.
# Exit: 0 if all passed; 1 if not; 2 usage.
set -euo pipefail
usage() { sed -n '2,/^set -/s/^# \{0,1\}//p' "$0"; }
refuse() { echo "run.sh: $1" >&2; usage >&2; exit 2; }
if [ "${1:-}" = --help ]; then usage; exit 0; fi
here=$(cd "$(dirname "$0")" && pwd)
root=$(cd "$here/../../.." && pwd)
directory=
if [ "${1:-}" = --server ]; then
  [ -f "${2:-}/page.env" ] || refuse "no server in: ${2:-}"
  directory=$2
  shift 2
fi
for test in "$@"; do
  [ -e "$here/$test.test.mjs" ] || refuse "unknown test: $test"
done
bin=${LIQUIDBLEND_BINARY_DIR:-${BUILD:-$root/build/release}/bin}
export LEAK_FRAMES=${LEAK_FRAMES:-300} LIQUIDBLEND_CLI=$bin/liquidblend

# run_at DIRECTORY [TEST..]: the tests with the server of the directory.
run_at() {
  local at=$1
  shift
  (
    set -a
    # shellcheck disable=SC1091  # written by server.sh
    . "$at/page.env"
    cd "$here"
    node run.mjs "$@"
  )
}

# run_token DIRECTORY: those of tokens; the token must be in no line of the server's log.
run_token() {
  "$bin/liquidblend-server" --make-token tester --scopes frames >"$1/tokens.json" 2>"$1/token"
  TOKEN=$(head -n 1 "$1/token")
  export TOKEN
  "$here/server.sh" restart "$1" --tokens "$1/tokens.json"
  run_at "$1" token
  local encoded
  encoded=$(printf %s "$TOKEN" | base64 | tr '+/' '-_' | tr -d '=')
  if grep -F -e "$TOKEN" -e "$encoded" "$1/server.log"; then
    echo "run.sh: the server's log has the token" >&2
    exit 1
  fi
}

if [ -n "$directory" ]; then
  case " $* " in *" token "*) refuse "token needs a server of its own" ;; esac
  run_at "$directory" "$@"
  exit
fi
directory=$(mktemp -d)
trap '"$here/server.sh" stop "$directory"' EXIT
"$here/server.sh" start "$directory" >/dev/null
if [ "$*" != token ]; then run_at "$directory" "$@"; fi
if [ $# = 0 ] || [ "$*" = token ]; then run_token "$directory"; fi
