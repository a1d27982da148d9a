#!/usr/bin/env bash
# Runs a throw-away PostgreSQL 15 in the foreground until it gets SIGINT or SIGTERM, or whoever
# started it ends. It listens on a unix socket alone; its only user is liquidblend, without password.
#   tests/postgres.sh DIRECTORY [SETTING=VALUE ...]
# DIRECTORY keeps the data (an earlier run's are taken up again) and DIRECTORY/sock the socket; as
# root, the server runs as the user postgres, to whom DIRECTORY is given.
set -euo pipefail
usage() { sed -n '2,/^set -/s/^# \{0,1\}//p' "$0"; }
refuse() { echo "postgres.sh: $1" >&2; usage >&2; exit 2; }
case ${1:-} in
  --help) usage; exit 0 ;;
  '') refuse "no DIRECTORY given" ;;
  -*) refuse "unknown argument: $1" ;;
esac
directory=$1
shift
bin=${LIQUIDBLEND_POSTGRES_BIN:-/usr/lib/postgresql/15/bin}
settings=()
for setting in "$@"; do
  [[ $setting = [a-z]*=* ]] || refuse "unknown argument: $setting"
  settings+=(-c "$setting")
done

become=()
mkdir -p "$directory/sock"
if [ "$(id -u)" = 0 ]; then
  become=(--reuid postgres --regid postgres --init-groups)
  chown -R postgres "$directory"
fi
chmod 755 "$directory" "$directory/sock"

if [ ! -f "$directory/data/PG_VERSION" ]; then
  setpriv "${become[@]}" "$bin/initdb" -D "$directory/data" -A trust -U liquidblend -E UTF8 \
    --locale=C --no-sync >"$directory/initdb.log" 2>&1 || { cat "$directory/initdb.log" >&2; exit 1; }
fi
exec setpriv "${become[@]}" --pdeathsig INT "$bin/postgres" -D "$directory/data" \
  -k "$directory/sock" -c listen_addresses= -c max_connections=100 "${settings[@]}" \
  >>"$directory/postgres.log" 2>&1
