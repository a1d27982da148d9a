# Stores and a server for a script.
# Sourced; wants the working directory to be the repository's, and $work, a folder of the script's
# own that all may enter.
store=()  # arguments of programs
server=   # HOST:PORT
server_pid=
postgres_pid=

# end PID: ends the process by SIGTERM and waits for it; an empty PID is none.
end() {
  [ -n "$1" ] || return 0
  kill "$1" 2>/dev/null || true
  wait "$1" 2>/dev/null || true
}

# Starts PostgreSQL and S3; sets $store to an empty database and an empty bucket.
start_shared_stores() {
  tests/postgres.sh "$work/postgres" </dev/null &
  postgres_pid=$!
  tests/ceph.sh start "$work/ceph" >/dev/null
  set -a
  # shellcheck disable=SC1091  # where the object store is
  . "$work/ceph/s3.env"
  set +a
  for _ in $(seq 300); do
    ! psql -h "$work/postgres/sock" -U liquidblend -d postgres -c 'SELECT 1' >/dev/null 2>&1 || break
    sleep 0.1
  done
  store=(--store "postgresql://liquidblend@/postgres?host=$work/postgres/sock"
    --blobs s3://liquidblend)
}

stop_shared_stores() {
  end "$postgres_pid"
  postgres_pid=
  [ ! -d "$work/ceph" ] || tests/ceph.sh stop "$work/ceph" || true
}

# start_server PROGRAM ARGUMENTS...: with a worker of its own; sets $server and $server_pid.
start_server() {
  : >"$work/server.out"  # not what the server before said
  "$1" --listen 127.0.0.1:0 --workers 1 "${@:2}" >"$work/server.out" 2>"$work/server.log" \
    </dev/null &
  server_pid=$!
  for _ in $(seq 300); do
    server=$(sed -n 's/^listening on //p' "$work/server.out")
    [ -z "$server" ] || return 0
    kill -0 "$server_pid" 2>/dev/null || break
    sleep 0.1
  done
  cat "$work/server.log" >&2
  echo "$(basename "$0"): the server did not start" >&2
  exit 1
}

stop_server() {
  end "$server_pid"
  server_pid=
}
