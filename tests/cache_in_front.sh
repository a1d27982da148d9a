#!/usr/bin/env bash
# Two servers of one store behind deploy/cache/nginx.conf: the cache gives what they give, to the
# byte; it keeps nothing that is private, missing or may change; a server that stops is not noticed.
# Then a load with and without the cache, by turns, as a table.
#   tests/cache_in_front.sh [BUILD [SECONDS]]
#     BUILD    folder of the build, with the targets liquidblend, liquidblend-server,
#              liquidblend-worker and lb_http_load (build/release)
#     SECONDS  of each row of the load (20)
# Wants deploy/install-deps.sh --cache, and what that installs besides. Ports are free ones of
# 127.0.0.1; all that it starts ends with it.
# Exit: 0 all is well; 1 something is not; 2 usage; 77 this host cannot run it.
set -Eeuo pipefail
usage() { sed -n '2,/^set -/s/^# \{0,1\}//p' "$0"; }
refuse() { echo "cache_in_front.sh: $1" >&2; usage >&2; exit 2; }
case ${1:-} in
  --help) usage; exit 0 ;;
  -*) refuse "unknown argument: $1" ;;
esac
[ $# -le 2 ] || refuse "too many arguments: $*"
here=$(cd "$(dirname "$0")/.." && pwd)
build=${1:-$here/build/release}
seconds=${2:-20}
[[ $seconds =~ ^[1-9][0-9]*$ ]] || refuse "not a number of seconds: $seconds"
bin=$build/bin
nginx=$(command -v nginx || command -v /usr/sbin/nginx || true)
cannot() { echo "cache_in_front.sh: this host cannot run it: $*" >&2; exit 77; }
[ -n "$nginx" ] || cannot "no nginx (deploy/install-deps.sh --cache)"
command -v radosgw >/dev/null || cannot "no radosgw (deploy/install-deps.sh)"
for program in liquidblend liquidblend-server liquidblend-worker lb_http_load; do
  [ -x "$bin/$program" ] || refuse "not built: $bin/$program"
done

work=$(mktemp -d)
chmod 755 "$work"  # for the user postgres
declare -A pids=()
clean_up() {
  local status=$? name
  trap - ERR EXIT
  for name in "${!pids[@]}"; do kill "${pids[$name]}" 2>/dev/null || true; done
  for name in "${!pids[@]}"; do wait "${pids[$name]}" 2>/dev/null || true; done
  "$here/tests/ceph.sh" stop "$work/ceph" || true
  rm -rf "$work"
  exit $status
}
trap clean_up EXIT
trap 'echo "cache_in_front.sh: failed at: $BASH_COMMAND" >&2; tail -n 5 "$work"/*.log >&2' ERR
trap 'exit 130' INT TERM

fail() { echo "cache_in_front.sh: $*" >&2; tail -n 5 "$work"/*.log >&2; exit 1; }

# await SECONDS COMMAND..
await() {
  local end=$((SECONDS + $1))
  shift
  until "$@" >/dev/null 2>&1; do
    [ $SECONDS -lt $end ] || fail "gave up waiting for: $*"
    sleep 0.2
  done
}

# start_server NAME GRPC_PORT HTTP_PORT [ARGUMENT..]
start_server() {
  local name=$1
  "$bin/liquidblend-server" --blobs s3://liquidblend/cached --cache "$work/$name" \
    --listen "127.0.0.1:$2" --http "127.0.0.1:$3" --http-host liquid.example "${@:4}" \
    >/dev/null 2>"$work/$name.log" </dev/null &
  pids[$name]=$!
  await 60 curl -fsS "http://127.0.0.1:$3/readyz"
}

stop() {  # NAME
  kill "${pids[$1]}"
  wait "${pids[$1]}" || fail "$1 ended with $?"
  unset "pids[$1]"
}

# start_nginx NAME PORT SERVER_PORT..: the example with the lines that are marked changed
start_nginx() {
  local name=$1 port=$2 servers="" server
  shift 2
  mkdir -p "$work/$name"
  for server in "$@"; do
    servers+="    server 127.0.0.1:$server max_fails=1 fail_timeout=2s;\n"
  done
  awk -v servers="$servers" '/server 127.*# yours/ { if (!done++) printf servers; next } { print }' \
    "$here/deploy/cache/nginx.conf" |
    sed -e "s#/run/nginx.pid#$work/$name/pid#" -e "s#/var/log/nginx#$work/$name#" \
      -e "s#/var/cache/nginx/liquidblend#$work/$name/frames#" -e "s#127.0.0.1:8088#127.0.0.1:$port#" \
      >"$work/$name.conf"
  "$nginx" -p "$work/$name" -c "$work/$name.conf" -e "$work/$name.log" \
    -g "daemon off; user $(id -un) $(id -gn);" </dev/null >/dev/null 2>&1 &
  pids[$name]=$!
  await 10 curl -sS -o /dev/null "http://127.0.0.1:$port/healthz"
}

# ask PATH [CURL_ARGUMENT..]: asks the cache; $code, $cache (HIT..), headers in $work/headers, the
# body in $work/body
ask() {
  local path=$1
  shift
  code=$(curl -sS -D "$work/headers" -o "$work/body" -w '%{http_code}' "$@" "$front$path")
  cache=$(header x-cache)
}
header() { sed -n "s/^$1: \(.*\)\r\$/\1/Ip" "$work/headers"; }
expect() { [ "$2" = "$3" ] || fail "$1: expected '$3', got '$2'"; }

read -r grpc1 http1 grpc2 http2 grpc3 http3 port1 port3 < <("$here/tests/free_ports.sh" 8)
front=http://127.0.0.1:$port1
client=("$bin/liquidblend" --server "127.0.0.1:$grpc1,127.0.0.1:$grpc2" --quiet)
register() {
  "${client[@]}" register drops --source a --target b --iterations 1 --wait "$@" || [ $? = 6 ]
}

echo "== two servers and a cache"
"$here/tests/ceph.sh" start "$work/ceph"
set -a
. "$work/ceph/s3.env"
set +a
"$here/tests/postgres.sh" "$work/postgres" </dev/null &
pids[postgres]=$!
await 30 test -S "$work/postgres/sock/.s.PGSQL.5432"
export LIQUIDBLEND_STORE="postgresql://liquidblend@/postgres?host=$work/postgres/sock"
start_server server1 "$grpc1" "$http1" --workers 1
start_server server2 "$grpc2" "$http2" --workers 0
start_nginx cache "$port1" "$http1" "$http2"
"${client[@]}" import a "$here/tests/data/two_drops/A"
"${client[@]}" import b "$here/tests/data/two_drops/B"
register
frame="/v1/families/drops/frame.drc?weights=0.5&time=0.31"

echo "== the same bytes of both servers and of the cache"
"$bin/lb_http_load" --compare --family drops --duration 2.9 --frames 202 \
  --base "http://127.0.0.1:$http1" --base "http://127.0.0.1:$http2" --base "$front"

echo "== what is kept"
ask "$frame&version=1"
expect "a new frame" "$code $cache" "200 MISS"
cp "$work/body" "$work/first"
tag=$(header etag)
ask "$frame&version=1" -H "X-Request-Id: mine"
expect "the same frame" "$code $cache $(header etag) $(header x-request-id)" "200 HIT $tag mine"
cmp "$work/body" "$work/first"
ask "$frame&version=1" -H "If-None-Match: $tag"
expect "a frame that the client has" "$code $cache" "304 HIT"
ask "$frame&version=1" -H "Host: liquid.example"
expect "the same frame by the site's name" "$code $cache" "200 HIT"

echo "== what is not"
for path in "$frame" "$frame&version=2" "$frame&version=1&colour=red" "/v1/families/none/frame.drc" \
  "/v1/animations/a/frame.drc?timeS=0.5"; do
  ask "$path"
  ask "$path"
  [ "$cache" != HIT ] || fail "$path is kept: $code"
done
ask "$frame&version=2"
expect "a version to come" "$code" 404
register --replace
await 30 curl -fsS -o "$work/body" "$front$frame&version=2"
ask "$frame&version=2"
expect "a version that has come" "$code $cache" "200 HIT"
ask "$frame"
expect "the newest version" "$code $(header x-liquidblend-version)" "200 2"
ask "$frame&version=1"
expect "a version that was replaced" "$code $cache" "200 HIT"
cmp "$work/body" "$work/first"
code=$(curl -sS -o "$work/body" -w '%{http_code}' -H "Connection: Upgrade" -H "Upgrade: websocket" \
  -H "Sec-WebSocket-Version: 13" -H "Sec-WebSocket-Key: bGlxdWlkYmxlbmQtdGVzdA==" --max-time 1 \
  "$front/v1/stream" || true)
expect "a WebSocket" "$code" 101

echo "== what is private"
"$bin/liquidblend-server" --make-token ann >"$work/tokens.json" 2>"$work/token"
token=$(head -n 1 "$work/token")
start_server server3 "$grpc3" "$http3" --workers 0 --tokens "$work/tokens.json"
start_nginx private "$port3" "$http3"
front=http://127.0.0.1:$port3
for _ in 1 2; do
  ask "$frame&version=1" -H "Authorization: Bearer $token"
  expect "with a token" "$code $(header cache-control | cut -d, -f1)" "200 private"
  [ "$cache" != HIT ] || fail "an answer to a request with a token is kept"
  ask "$frame&version=1"
  expect "without a token" "$code" 401
done
stop private
stop server3
front=http://127.0.0.1:$port1

echo "== a server stops while frames are asked for"
"$bin/lb_http_load" --family drops --duration 2.9 --base "$front" --exponent 0 --clients 4 \
  --seconds 6 --name "a server stops" >"$work/stops" &
load=$!
sleep 2
stop server2
sleep 1
start_server server2 "$grpc2" "$http2" --workers 0
wait $load || fail "calls failed: $(cat "$work/stops")"
cat "$work/stops"

echo "== load, $seconds s a row"
echo "| way | clients | frames | failed | frames/s | p50 ms | p99 ms | max ms | hits |"
echo "| --- | --- | --- | --- | --- | --- | --- | --- | --- |"
# row NAME BASE..
row() {
  local before=0 bases=() base line
  for base in "${@:2}"; do bases+=(--base "$base"); done
  before=$(wc -l <"$work/cache/access.log")
  line=$("$bin/lb_http_load" --family drops --version-of-family 2 --duration 2.9 --name "$1" \
    --seconds "$seconds" "${bases[@]}") || fail "calls failed: $line"
  tail -n +$((before + 1)) "$work/cache/access.log" | awk -v line="$line" '
    / HIT / { ++hits } { ++all } END { printf "%s %s |\n", line, all ? sprintf("%.0f %%", 100 * hits / all) : "" }'
}
servers=("http://127.0.0.1:$http1" "http://127.0.0.1:$http2")
row "two servers" "${servers[@]}"
row "cache, empty at first" "$front"
row "two servers, again" "${servers[@]}"
row "cache, again" "$front"

echo "== a deleted family is purged"
"${client[@]}" delete drops
ask "$frame&version=1"
expect "a frame that is kept" "$code $cache" "200 HIT"
rm -rf "$work/cache/frames"/*
ask "$frame&version=1"
expect "a frame that was purged" "$code" 404
echo "all is well"
