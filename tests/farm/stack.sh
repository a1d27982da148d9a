# What tests/farm.sh starts: PostgreSQL, S3, a server without workers, Slurm.
# Sourced; wants the working directory to be the repository's, and $bin.
. tests/phases.sh
scratch=
server=  # HOST:PORT
max_lost_s=${MAX_LOST_S:-10}
seed=${SEED:-$RANDOM}
spacing=${SPACING:-0.9}
processes=()  # started in the background, to be ended: the last one first

show_logs() {
  local log
  for log in "$scratch"/logs/*; do
    [ -s "$log" ] || continue
    echo "---- $(basename "$log")" >&2
    tail -n 15 "$log" >&2
  done
}

clean_up() {
  local status=$? pid
  trap - ERR EXIT
  trap '' INT TERM
  set +e
  print_table
  if [ -n "$scratch" ]; then
    {
      tests/slurm.sh stop "$scratch/slurm"
      for pid in "${processes[@]}"; do kill -INT "$pid" && wait "$pid"; done
      tests/ceph.sh stop "$scratch/ceph"
    } >/dev/null 2>&1
    rm -rf "$scratch"
  fi
  exit $status
}

# background LOG COMMAND...: its id is $!
background() {
  "${@:2}" </dev/null >"$scratch/logs/$1" 2>&1 &
  processes=("$!" "${processes[@]}")
}

check_host() {
  local program
  [ "$(id -u)" = 0 ] || cannot "not root"
  for program in slurmctld slurmd munged radosgw /usr/lib/postgresql/15/bin/postgres; do
    command -v $program >/dev/null || cannot "no $program (deploy/install-deps.sh --farm)"
  done
  for program in liquidblend liquidblend-server liquidblend-worker; do
    [ -x "$bin/$program" ] || fail "no $program in $bin; build it first"
  done
}

start_stack() {
  local store
  scratch=$(mktemp -d)
  chmod 755 "$scratch"  # for the user postgres
  mkdir "$scratch/logs" "$scratch/cache"
  background postgres tests/postgres.sh "$scratch/postgres" fsync=off
  tests/ceph.sh start "$scratch/ceph"
  store="postgresql://liquidblend@/postgres?host=$scratch/postgres/sock"
  {
    cat "$scratch/ceph/s3.env"
    echo "# as a site would write it"
    echo "LIQUIDBLEND_STORE=$store"
    echo "LIQUIDBLEND_BLOBS=s3://liquidblend/farm"
    echo "LIQUIDBLEND_CACHE=$scratch/cache"
    echo "LIQUIDBLEND_WORKER=$bin/liquidblend-worker"
  } >"$scratch/farm.env"
  set -a
  . <(sed "s/=\(.*\)/='\1'/" "$scratch/farm.env")
  set +a
  await 30 "$bin/liquidblend-worker" --check
  background server "$bin/liquidblend-server" --workers 0 --listen 127.0.0.1:0
  await 30 grep -q '^listening on ' "$scratch/logs/server"
  server=$(sed -n 's/^listening on //p' "$scratch/logs/server")
  tests/slurm.sh start "$scratch/slurm"
  export SLURM_CONF=$scratch/slurm/slurm.conf
}

lb() { "$bin/liquidblend" --server "$server" --quiet "$@"; }

# Of an operation in JSON.
name_of() { /usr/bin/python3 -c 'import json, sys; print(json.load(sys.stdin)["name"])'; }

# register FAMILY [FLAG ..]: submits drops_a -> drops_b, and prints its operation
register() {
  lb --json register "$1" --replace --source drops_a --target drops_b --spacing "$spacing" \
    "${@:2}" | name_of
}

# field OPERATION EXPRESSION: of `operations --json`, as o
field() {
  lb --json operations "$1" |
    /usr/bin/python3 -c "import json, sys; o = json.load(sys.stdin); print($2)"
}

is_done() { [ "$(field "$1" 'o["done"]')" = True ]; }

expect_success() {  # OPERATION
  is_done "$1" && [ "$(field "$1" '"error" in o')" = False ] || fail "$1 has not succeeded"
}

hash_of() {  # FAMILY
  lb download "families/$1" -o "$scratch/family" >/dev/null
  sha256sum <"$scratch/family" | cut -d' ' -f1
}

# A worker outside of the farm that nothing happens to, until nothing is left to do.
work_undisturbed() {
  "$bin/liquidblend-worker" --drain --idle-time 0s >"$scratch/logs/undisturbed" 2>&1 ||
    fail "the worker that nothing happens to has failed"
}
