# The phases of tests/kubernetes.sh that play deploy/kubernetes. Sourced after phases.sh.
# What podman 4.3 makes of it: a pod NAME-pod-K for each replica; volumes named as those of the pods,
# their claims and secrets; no services and no network policies.
kube_images=(server worker e2e postgres s3)
kube_volumes=(cache tmp liquidblend-postgres-data liquidblend-s3-data liquidblend-s3)
kube_secrets=(liquidblend-database liquidblend-s3)
kube_servers=(liquidblend-server-pod-0 liquidblend-server-pod-1)
kube_workers=(liquidblend-worker-{small,medium,large}-pod-0)
kube_stores=(liquidblend-postgres-pod-0 liquidblend-s3-pod-0)
kube_pods=("${kube_servers[@]}" "${kube_workers[@]}" "${kube_stores[@]}")
kube_is_ours=0

kube_down() {
  [ $kube_is_ours = 1 ] || return 0
  podman pod rm --force --time 0 "${kube_pods[@]}"
  podman volume rm --force "${kube_volumes[@]}"
  podman secret rm "${kube_secrets[@]}"
}

own_containers() {
  podman ps -a --filter "label=$project" --format '{{.Names}}'
  [ $kube_is_ours = 0 ] || podman ps -a --format '{{.Names}}' |
    grep -E '^liquidblend-.*-pod-[0-9]+-' || true
}

check_names() {
  local name
  for name in "${kube_pods[@]}"; do
    ! podman pod exists "$name" || cannot "podman has a pod $name already"
  done
  for name in "${kube_volumes[@]}"; do
    ! podman volume exists "$name" || cannot "podman has a volume $name already"
  done
  for name in "${kube_secrets[@]}"; do
    ! podman secret inspect "$name" >/dev/null 2>&1 || cannot "podman has a secret $name already"
  done
  command -v kubectl >/dev/null || cannot "there is no kubectl; deploy/install-deps.sh"
  kube_is_ours=1
}

build_kube_images() { build_targets "${kube_images[@]}"; }

# overlay NAME FOLDER: makes a kustomization of this folder of deploy/kubernetes with the images of
# this test; more of it is read from standard input
overlay() {
  local folder=$scratch/$1 image
  mkdir "$folder"
  {
    printf 'bases:\n  - %s\n' "$(realpath --relative-to="$folder" "deploy/kubernetes/$2")"
    echo "images:"
    for image in "${kube_images[@]}"; do
      printf '  - name: localhost/liquidblend-%s\n    newTag: test\n' "$image"
    done
    cat
  } >"$folder/kustomization.yaml"
}

# play NAME [podman's options]: renders the overlay NAME and starts its pods
play() {
  local name=$1
  shift
  kubectl kustomize "$scratch/$name" >"$scratch/$name.yaml" 2>"$scratch/kubectl" ||
    { cat "$scratch/kubectl" >&2; fail "kubectl kustomize"; }
  quietly podman kube play --network "$network" "$@" "$scratch/$name.yaml" >/dev/null
}

# Podman 4.3 reads secrets for variables as JSON, and those for volumes as YAML without base64.
make_kube_secrets() {
  local made url password
  made=$(deploy/kubernetes/make-secrets.sh "$(address_of postgres)")
  url=$(sed -n 's/^  url: //p' <<<"$made")
  password=$(sed -n 's/^  password: "\(.*\)"/\1/p' <<<"$made")
  printf '{"url": "%s", "password": "%s"}' "$(printf %s "$url" | base64 -w 0)" \
    "$(printf %s "$password" | base64 -w 0)" | podman secret create liquidblend-database - >/dev/null
  {
    printf 'apiVersion: v1\nkind: Secret\nmetadata:\n  name: liquidblend-s3\ndata:\n'
    sed -n '/^  credentials:/,$p' <<<"$made"
  } | podman secret create liquidblend-s3 - >/dev/null
}

# Runs the readiness probe of a pod's container.
is_ready() { podman exec "$@"; }

play_stores() {
  make_kube_secrets
  overlay postgres stores/postgres </dev/null
  overlay s3 stores/s3 </dev/null
  play postgres --ip "$(address_of postgres)"
  play s3 --ip "$(address_of s3)"
  await 60 is_ready liquidblend-postgres-pod-0-postgres pg_isready --quiet --host=127.0.0.1
  await 120 is_ready liquidblend-s3-pod-0-s3 test -f /var/lib/ceph/one/ready
}

play_many_machines() {
  overlay many-machines overlays/many-machines <<YAML
configMapGenerator:
  - name: liquidblend-store
    behavior: merge
    literals:
      - AWS_ENDPOINT_URL=http://$(address_of s3):7480
YAML
  play many-machines
  local pod
  for pod in "${kube_servers[@]}"; do
    await 60 is_ready $pod-server liquidblend-server --check --listen=0.0.0.0:50051
  done
  for pod in "${kube_workers[@]}"; do
    await 60 is_ready $pod-worker liquidblend-worker --check
  done
}

# As the manifests want it: not root, nothing written but volumes, no capabilities, memory limited.
check_confined() {
  local container said num_checked=0
  for container in $(own_containers); do
    said=$(podman exec "$container" sh -c '
      id -u; touch /root-file 2>&1; sed -n "s/^Cap\(Prm\|Eff\|Bnd\):\t0*$/none/p" /proc/self/status')
    [ "$(head -n 1 <<<"$said")" -ge 10001 ] || fail "$container runs as ${said%%$'\n'*}"
    grep -q "Read-only file system" <<<"$said" || fail "$container writes to its root: $said"
    [ "$(grep -c '^none$' <<<"$said")" = 3 ] || fail "$container has capabilities: $said"
    [ "$(podman inspect --format '{{.HostConfig.Memory}}' "$container")" -gt 0 ] ||
      fail "$container has no limit of memory"
    num_checked=$((num_checked + 1))
  done
  [ $num_checked = ${#kube_pods[@]} ] || fail "$num_checked of ${#kube_pods[@]} containers"
}

address_of_pod() {  # POD
  podman inspect --format "{{(index .NetworkSettings.Networks \"$network\").IPAddress}}" \
    "$(podman pod inspect --format '{{.InfraContainerID}}' "$1")"
}

run_kube_e2e() {
  local servers pod
  for pod in "${kube_servers[@]}"; do servers+=${servers:+,}$(address_of_pod $pod):50051; done
  podman run --rm --init --no-healthcheck --name "$project-suite" "${confined[@]}" \
    --network "$network" --env "LIQUIDBLEND_E2E_SERVERS=$servers" "$(image e2e)" \
    suite.sh running || fail "not all tests pass"
}
