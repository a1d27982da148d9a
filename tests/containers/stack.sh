# Containers of tests/containers.sh and tests/kubernetes.sh: how they are started, asked and removed.
# Sourced; wants the working directory to be the repository's.
. tests/containers/common.sh
lease_s=5

# Everyone has a fixed address and knows the others' from /etc/hosts, and clients of gRPC, which asks
# name servers for IPv6 in any case, are given addresses: podman's name server passes on to the
# host's what it does not know, and how soon that answers is not to be tested here.
members=(postgres s3 server1 server2 worker1 worker2 client tests steady suite)
subnet=  # of the network: 10.89.0

make_network() {
  podman network create --disable-dns "$network" >/dev/null || return 1
  subnet=$(podman network inspect "$network" | sed -n 's/.*"subnet": "\(.*\)\.0\/.*/\1/p')
}

address_of() {  # MEMBER
  local k
  for k in "${!members[@]}"; do [ "${members[k]}" != "$1" ] || echo "$subnet.$((k + 10))"; done
}

both_servers() { echo "$(address_of server1):50051,$(address_of server2):50051"; }

hosts_options() {
  local member
  for member in "${members[@]}"; do echo "--add-host=$member:$(address_of "$member")"; done
}

image() { echo "localhost/liquidblend-$1:${2:-test}"; }

# How every container of ours runs.
confined=(--label "$project" --read-only --tmpfs /tmp --cap-drop ALL
  --security-opt no-new-privileges)
# The scene, for the image client.
scene=(--volume "$PWD/tests/data/two_drops:/data/two_drops:ro")

on_network() {  # MEMBER
  echo --network "$network" --ip "$(address_of "$1")" $(hosts_options)
}

# run NAME IMAGE [podman's options] -- [the container's arguments]
run() {
  local name=$1 of=$2 options=()
  shift 2
  while [ $# -gt 0 ] && [ "$1" != -- ]; do options+=("$1"); shift; done
  shift || true
  quietly podman run --detach --name "$project-$name" --hostname "$name" "${confined[@]}" \
    $(on_network "$name") --env-file "$scratch/service.env" "${options[@]}" "$of" "$@" >/dev/null
}

start_server() {  # NAME IMAGE
  run "$1" "$2" --memory 2g -- --listen 0.0.0.0:50051 --http 0.0.0.0:8080 --http-host "$1" \
    --insecure --workers 0 --threads 1 --log-format json
}

start_worker() {  # NAME IMAGE
  run "$1" "$2" --memory 4g -- --lease ${lease_s}s --poll 200ms --threads 1 --log-format json
}

is_healthy() { podman healthcheck run "$project-$1"; }

replace() {  # server|worker NAME IMAGE: as an operator does it
  quietly podman stop --time 30 "$project-$2" >/dev/null
  quietly podman rm --volumes "$project-$2" >/dev/null
  "start_$1" "$2" "$3"
  await 60 is_healthy "$2"
}

client() { podman exec "$project-client" "$@"; }
tests() { podman exec "$project-tests" "$@"; }

# The command in the client container, patient on a busy machine.
liquidblend() { client liquidblend --connect-timeout 30 --quiet "$@"; }

# Which bytes a family's frames have at one server.
frames_of() {  # FAMILY SERVER
  client sh -c 'for weight in 0 0.5 1.25; do for time in 0 0.8 2; do
      liquidblend --server "$2" --connect-timeout 30 --quiet frame "$1" -w $weight -t $time -o /tmp/frame.drc \
        >/dev/null && sha256sum </tmp/frame.drc || exit 1
    done; done' sh "$1" "$(address_of "$2"):50051"
}

# The field of an operation: `field OPERATION '["progress"]["worker"]'`
field() {
  liquidblend --json operations "$1" | python3 -c "
import json, sys
print(json.load(sys.stdin)$2)"
}
