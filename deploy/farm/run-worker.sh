#!/usr/bin/env bash
# Runs liquidblend-worker as a task of a farm, in place of this shell: until there is nothing left to
# do (docs/operations/farms.md).
#   run-worker.sh ENVIRONMENT_FILE [FLAG ..]     e.g. --threads 2 --memory 4GiB --max-time 2h
# ENVIRONMENT_FILE: lines NAME=VALUE (environment.sample); credentials are seen in no arguments.
# Exit: the worker's.
set -euo pipefail
usage() { sed -n '2,/^set -/s/^# \{0,1\}//p' "$0"; }
refuse() { echo "run-worker.sh: $1" >&2; usage >&2; exit 2; }
case ${1:-} in
  --help) usage; exit 0 ;;
  '') refuse "no ENVIRONMENT_FILE given" ;;
  -*) refuse "unknown argument: $1" ;;
esac
[ -r "$1" ] || refuse "cannot read $1"
while IFS= read -r line || [ -n "$line" ]; do
  case $line in '' | '#'*) continue ;; esac
  # It may be a secret: only the file is named.
  [[ $line =~ ^[A-Za-z_][A-Za-z0-9_]*= ]] || refuse "neither NAME=VALUE nor a comment in $1"
  export "${line?}"
done <"$1"
shift

# Everybody may write to /tmp and knows the folder's name: another user may have made it before.
# A folder that is given is left as it is: the studio may want users to share it.
if [ -z "${LIQUIDBLEND_CACHE:-}" ]; then
  LIQUIDBLEND_CACHE=${TMPDIR:-/tmp}/liquidblend-$(id -u)
  (umask 077 && mkdir -p "$LIQUIDBLEND_CACHE") || true
  if [ -L "$LIQUIDBLEND_CACHE" ] || [ ! -d "$LIQUIDBLEND_CACHE" ] || [ ! -O "$LIQUIDBLEND_CACHE" ]; then
    refuse "$LIQUIDBLEND_CACHE is no folder of this user's own: remove it, or name another one, LIQUIDBLEND_CACHE"
  fi
  chmod 700 "$LIQUIDBLEND_CACHE"
fi
export LIQUIDBLEND_CACHE
export LIQUIDBLEND_CACHE_SIZE=${LIQUIDBLEND_CACHE_SIZE:-8GiB}
exec "${LIQUIDBLEND_WORKER:-/usr/bin/liquidblend-worker}" --drain "$@"
