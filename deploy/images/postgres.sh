#!/usr/bin/env bash
# PostgreSQL 15 in a container, for all addresses; the first start makes user and database.
#   POSTGRES_PASSWORD (or POSTGRES_PASSWORD_FILE), POSTGRES_USER=postgres, POSTGRES_DB=POSTGRES_USER
# Arguments go to the server: -c fsync=off
set -euo pipefail
PATH=/usr/lib/postgresql/15/bin:$PATH
data=/var/lib/postgresql/data/pgdata
user=${POSTGRES_USER:-postgres}

if [ ! -f "$data/ready" ]; then
  password=${POSTGRES_PASSWORD:-$(cat "${POSTGRES_PASSWORD_FILE:?POSTGRES_PASSWORD is not set}")}
  rm -rf "$data"  # of a first start that was cut off
  initdb --pgdata="$data" --username="$user" --pwfile=<(echo "$password") --auth=scram-sha-256 \
    --auth-local=trust --encoding=UTF8 --locale=C
  echo "host all all all scram-sha-256" >>"$data/pg_hba.conf"
  pg_ctl --pgdata="$data" --wait -o "-c listen_addresses= -k /tmp" start
  database=${POSTGRES_DB:-$user}
  [ "$database" = postgres ] || createdb --host=/tmp --username="$user" "$database"
  pg_ctl --pgdata="$data" --wait stop
  touch "$data/ready"
fi
exec postgres -D "$data" -k /tmp -c listen_addresses='*' "$@"
