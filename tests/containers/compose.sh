# The phases of tests/containers.sh that start deploy/compose. Sourced after phases.sh.
compose() { podman-compose --project-name "$project$compose_tier" --file "$compose_file" "$@"; }
compose_tier=

compose_down() {
  [ -z "$compose_tier" ] || compose down --volumes --timeout 5
}

# compose_up FILE SERVICE...: up, until all of these are healthy
compose_up() {
  compose_tier=$(basename "$1" .yaml | tr -d -)
  compose_file=$scratch/$(basename "$1")
  cp "$1" "$compose_file"
  shift
  export LIQUIDBLEND_SERVER_IMAGE LIQUIDBLEND_WORKER_IMAGE LIQUIDBLEND_POSTGRES_IMAGE
  export LIQUIDBLEND_S3_IMAGE LIQUIDBLEND_PORT LIQUIDBLEND_HTTP_PORT LIQUIDBLEND_PORT1
  export LIQUIDBLEND_PORT2 LIQUIDBLEND_HTTP_PORT1 LIQUIDBLEND_HTTP_PORT2
  LIQUIDBLEND_SERVER_IMAGE=$(image server)
  LIQUIDBLEND_WORKER_IMAGE=$(image worker)
  LIQUIDBLEND_POSTGRES_IMAGE=$(image postgres)
  LIQUIDBLEND_S3_IMAGE=$(image s3)
  read -r LIQUIDBLEND_PORT LIQUIDBLEND_HTTP_PORT LIQUIDBLEND_PORT1 LIQUIDBLEND_PORT2 \
    LIQUIDBLEND_HTTP_PORT1 LIQUIDBLEND_HTTP_PORT2 < <(tests/free_ports.sh 6)
  compose up -d >"$scratch/compose" 2>&1 || { cat "$scratch/compose" >&2; fail "compose up"; }
  local service
  for service in "$@"; do
    await 120 podman healthcheck run "$project${compose_tier}_${service}_1"
  done
}

# The way of the scene once more, over the published ports; its frames are those of before.
compose_scene() {  # ADDRESSES [podman's options]
  local server=$1
  shift
  podman run --rm --network host "${confined[@]}" "${scene[@]}" --env "LIQUIDBLEND_SERVER=$server" \
    "$@" --entrypoint sh "$(image client)" -ec '
      liquidblend --quiet import drops_a /data/two_drops/A >/dev/null
      liquidblend --quiet import drops_b /data/two_drops/B >/dev/null
      liquidblend --quiet register drops --source drops_a --target drops_b --spacing 2 --levels 0 \
        --iterations 24 --wait >/dev/null
      for weight in 0 0.5 1.25; do for time in 0 0.8 2; do
        liquidblend --quiet frame drops -w $weight -t $time -o /tmp/frame.drc >/dev/null
        sha256sum </tmp/frame.drc
      done; done' >"$scratch/frames"
  [ "$(cat "$scratch/frames")" = "$expected" ] || fail "other frames"
}

compose_embedded() {
  compose_up deploy/compose/one-machine.yaml server
  compose_scene "127.0.0.1:$LIQUIDBLEND_PORT"
  compose_down >/dev/null 2>&1
  compose_tier=
}

# An authority of its own, the server's certificate, tokens.json, and a client's CA.crt and token.
make_tls_secrets() {  # FOLDER
  local ec=(-newkey ec -pkeyopt ec_paramgen_curve:P-256 -nodes)
  (
    cd "$1"
    openssl req -x509 "${ec[@]}" -days 2 -subj "/CN=a test authority" -keyout ca.key -out ca.crt
    openssl req "${ec[@]}" -subj /CN=localhost -keyout server.key -out server.csr
    openssl x509 -req -in server.csr -CA ca.crt -CAkey ca.key -CAcreateserial -days 2 \
      -extfile <(echo "subjectAltName=DNS:localhost,IP:127.0.0.1") -out server.crt
  ) 2>"$scratch/openssl" || { cat "$scratch/openssl" >&2; fail "openssl"; }
  chown -R 10001:10001 "$1"
  podman run --rm --no-healthcheck --network none "${confined[@]}" --volume "$1:/out" \
    --entrypoint sh "$(image server)" -c '
      umask 077
      liquidblend-server --make-token studio --scopes frames,write,register \
        >/out/tokens.json 2>/out/studio.token'
}

compose_tls() {
  export LIQUIDBLEND_SECRETS=$scratch/secrets
  mkdir "$LIQUIDBLEND_SECRETS"
  make_tls_secrets "$LIQUIDBLEND_SECRETS"
  compose_up deploy/compose/one-machine-tls.yaml server
  local trust=(--volume "$LIQUIDBLEND_SECRETS:/run/liquidblend:ro"
    --env LIQUIDBLEND_TLS_CA=/run/liquidblend/ca.crt)
  compose_scene "localhost:$LIQUIDBLEND_PORT" "${trust[@]}" \
    --env LIQUIDBLEND_TOKEN_FILE=/run/liquidblend/studio.token
  local said
  said=$(podman run --rm --network host "${confined[@]}" "${trust[@]}" "$(image client)" \
    --server "localhost:$LIQUIDBLEND_PORT" list 2>&1) && fail "no token is needed"
  grep -q TOKEN_MISSING <<<"$said" || fail "without a token: $said"
  compose_down >/dev/null 2>&1
  compose_tier=
}

compose_scale_out() {
  deploy/compose/make-secrets.sh "$scratch"
  compose_up deploy/compose/many-machines.yaml postgres s3 server1 server2 worker1 worker2
  compose_scene "127.0.0.1:$LIQUIDBLEND_PORT1,127.0.0.1:$LIQUIDBLEND_PORT2"
  compose_down >/dev/null 2>&1
  compose_tier=
}
