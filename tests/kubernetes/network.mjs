// The rules of network policies that every overlay keeps. Each returns what is wrong.
import { claim, client, forContainers, labelsOf, matches, podsOf } from './claims.mjs';
import { nameOf, ofKind, workloadsOf } from './manifests.mjs';

// Each pod is cut off from all, but for what another policy permits to it by ports and peers.
export function deniedByDefault(objects) {
  const policies = ofKind(objects, 'NetworkPolicy');
  const denies = ({ spec }, type, labels) => spec.policyTypes.includes(type) &&
    !spec.ingress && !spec.egress && matches(spec.podSelector, labels);
  return [
    ...workloadsOf(objects).flatMap((workload) => ['Ingress', 'Egress'].flatMap((type) =>
      claim(policies.some((policy) => denies(policy, type, labelsOf(workload))),
        `${nameOf(workload)}: ${type} is not denied`))),
    ...policies.flatMap((policy) => [...(policy.spec.ingress ?? []), ...(policy.spec.egress ?? [])]
      .flatMap((rule) => claim(rule.ports?.length && (rule.from ?? rule.to)?.length,
        `${nameOf(policy)} permits all ports or all peers`))),
  ];
}

const directions = {
  Ingress: { rules: 'ingress', peers: 'from' },
  Egress: { rules: 'egress', peers: 'to' },
};

// The rules of one direction for pods with these labels: {ports, peers}.
function permissions(objects, type, labels) {
  const { rules: field, peers } = directions[type];
  return ofKind(objects, 'NetworkPolicy')
    .filter(({ spec }) => spec.policyTypes.includes(type) && matches(spec.podSelector, labels))
    .flatMap(({ spec }) => spec[field] ?? [])
    .map((rule) => ({ ports: rule.ports ?? [], peers: rule[peers] ?? [] }));
}

// What one direction permits between pods of the namespace, as "FROM to TO:PORT".
function ways(objects, type) {
  const pods = podsOf(objects);
  return pods.flatMap((pod) => permissions(objects, type, pod.labels).flatMap(({ ports, peers }) =>
    peers.filter(({ podSelector, namespaceSelector }) => podSelector && !namespaceSelector)
      .flatMap(({ podSelector }) => pods.filter(({ labels }) => matches(podSelector, labels)))
      .flatMap((peer) => ports.map(({ port }) => type === 'Ingress' ?
        `${peer.name} to ${pod.name}:${port}` : `${pod.name} to ${peer.name}:${port}`))));
}

// Both ends permit what one of them permits, as each is cut off from all by default. So clients reach
// each server.
export function permittedByBothEnds(objects) {
  const [into, out] = Object.keys(directions).map((type) => new Set(ways(objects, type)));
  return [
    ...[...into].flatMap((way) => claim(out.has(way), `${way} is not let out`)),
    ...[...out].flatMap((way) => claim(into.has(way), `${way} is not let in`)),
    ...workloadsOf(objects)
      .filter((workload) => labelsOf(workload)['app.kubernetes.io/component'] === 'server')
      .flatMap((server) => claim(into.has(`${client.name} to ${nameOf(server)}:50051`),
        `${nameOf(server)}: lets no client in`)),
  ];
}

const namespaceOf = ({ namespaceSelector }) =>
  namespaceSelector?.matchLabels?.['kubernetes.io/metadata.name'];

// Pods that may call anyone may resolve names, by the DNS of the cluster or a cache of the node.
export function namesResolved(objects) {
  return podsOf(objects).flatMap(({ name, labels }) => {
    const rules = permissions(objects, 'Egress', labels);
    if (!rules.length) return [];
    const asks = (peerIs) => ['UDP', 'TCP'].every((transport) => rules.some(({ ports, peers }) =>
      peers.some(peerIs) &&
      ports.some(({ protocol, port }) => protocol === transport && port === 53)));
    return [
      ...claim(asks((peer) => namespaceOf(peer) === 'kube-system'),
        `${name}: does not reach the DNS of the cluster`),
      ...claim(asks(({ ipBlock }) => ipBlock?.cidr === '169.254.20.10/32'),
        `${name}: does not reach NodeLocal DNSCache`),
    ];
  });
}

// Urls of services in other namespaces, such as http://minio.objects.svc, lead through a policy.
export function servicesReached(objects) {
  const data = new Map(ofKind(objects, 'ConfigMap').map((map) => [map.metadata.name, map.data]));
  return forContainers(objects, (container, pod, workload) => {
    const values = [
      ...(container.env ?? []).map(({ value }) => value),
      ...(container.envFrom ?? []).flatMap(({ configMapRef }) =>
        Object.values(data.get(configMapRef.name) ?? {})),
    ];
    const reached = permissions(objects, 'Egress', labelsOf(workload))
      .flatMap(({ peers }) => peers.map(namespaceOf));
    return values.flatMap((value) => {
      const [, service] = /^https?:\/\/[\w-]+\.([\w-]+)\.svc\b/.exec(value) ?? [];
      return claim(!service || reached.includes(service), `is not let out to ${value}`);
    });
  });
}
