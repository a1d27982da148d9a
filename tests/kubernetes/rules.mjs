// The rules that every overlay keeps, beyond what Kubernetes checks. Each returns what is wrong.
import { claim, forContainers, forPods, labelsOf, matches, podsOf } from './claims.mjs';
import { bytesOf, flagOf, isWorker, nameOf, ofKind, projectVersion, workloadsOf } from
  './manifests.mjs';
import { deniedByDefault, namesResolved, permittedByBothEnds, servicesReached } from
  './network.mjs';

export * from './network.mjs';

const namespace = 'liquidblend';
const clusterKinds = ['Namespace'];
// What docs/operations/kubernetes.md says how to make.
const secrets = ['liquidblend-database', 'liquidblend-s3', 'liquidblend-tls', 'liquidblend-tokens'];
const volumeKinds = ['emptyDir', 'secret', 'persistentVolumeClaim'];

// As the Pod Security Standard "restricted", and a root that nothing writes.
export function confined(objects) {
  return [
    ...forPods(objects, (pod) => {
      const context = pod.securityContext ?? {};
      return [
        ...claim(context.runAsNonRoot === true && context.runAsUser > 0 && context.runAsGroup > 0,
          'may run as root'),
        ...claim(context.seccompProfile?.type === 'RuntimeDefault', 'has no seccomp profile'),
        ...claim(!pod.hostNetwork && !pod.hostPID && !pod.hostIPC, 'shares namespaces of the node'),
        ...claim(pod.automountServiceAccountToken === false, 'has a token of Kubernetes'),
        ...claim(pod.enableServiceLinks === false, 'gets variables of services'),
        ...(pod.volumes ?? []).flatMap((volume) =>
          claim(Object.keys(volume).some((key) => volumeKinds.includes(key)),
            `volume ${volume.name} is of another kind`)),
      ];
    }),
    ...forContainers(objects, ({ securityContext: context = {} }) => [
      ...claim(context.readOnlyRootFilesystem === true, 'writes to its root'),
      ...claim(context.allowPrivilegeEscalation === false && !context.privileged,
        'may gain privileges'),
      ...claim(context.capabilities?.drop?.includes('ALL') && !context.capabilities.add,
        'has capabilities'),
    ]),
  ];
}

export function limited(objects) {
  return forContainers(objects, ({ resources = {} }) =>
    ['cpu', 'memory', 'ephemeral-storage'].flatMap((name) => [
      ...claim(resources.limits?.[name], `has no limit of ${name}`),
      ...claim(resources.requests?.[name], `requests no ${name}`),
    ]));
}

// Of this version, so that what runs is known, and of names that no registry has.
export function versioned(objects) {
  const version = projectVersion();
  return forContainers(objects, ({ image }) =>
    claim(/^localhost\/liquidblend-[a-z0-9]+:/.test(image) && image.endsWith(`:${version}`),
      `is of the image ${image}, not of ${version}`));
}

// A full disk of the node would stop its other pods: the files of a pod have limits.
export function disksLimited(objects) {
  return forPods(objects, (pod) => {
    const disks = (pod.volumes ?? []).filter((volume) => volume.emptyDir);
    const unlimited = disks.filter((volume) => !volume.emptyDir.sizeLimit);
    if (unlimited.length) return unlimited.map(({ name }) => `volume ${name} has no limit`);
    const sum = disks.reduce((bytes, volume) => bytes + bytesOf(volume.emptyDir.sizeLimit), 0);
    const limit = bytesOf(pod.containers[0].resources.limits['ephemeral-storage']);
    const cache = flagOf(pod.containers[0], 'cache-size');
    const room = disks.find(({ name }) => name === 'cache')?.emptyDir.sizeLimit;
    return [
      ...claim(sum <= limit, 'its volumes are larger than its limit of ephemeral-storage'),
      ...claim(!cache || 1.25 * bytesOf(cache) <= bytesOf(room), 'its cache fills its volume'),
    ];
  });
}

// No secret is in a manifest; those that are named can be made.
export function secretsByReference(objects) {
  const named = (container, pod) => [
    ...(container.env ?? []).map(({ valueFrom }) => valueFrom?.secretKeyRef?.name),
    ...(pod.volumes ?? []).map(({ secret }) => secret?.secretName),
  ].filter(Boolean);
  return [
    ...ofKind(objects, 'Secret').map((secret) => `${nameOf(secret)} is in the manifests`),
    ...forContainers(objects, (container, pod) => [
      ...named(container, pod).flatMap((name) =>
        claim(secrets.includes(name), `the secret ${name} is not documented`)),
      ...(container.env ?? []).flatMap(({ name, value }) =>
        claim(!value || !/_STORE$|PASSWORD|SECRET|_KEY/.test(name), `${name} has a value`)),
    ]),
  ];
}

// Names refer to objects that exist.
export function connected(objects) {
  const configured = ofKind(objects, 'ConfigMap').map((object) => object.metadata.name);
  const accounts = ofKind(objects, 'ServiceAccount').map((object) => object.metadata.name);
  const selects = (selector) =>
    workloadsOf(objects).some((workload) => matches(selector, labelsOf(workload)));
  const concerns = (selector) => podsOf(objects).some(({ labels }) => matches(selector, labels));
  return [
    ...objects.flatMap((object) => claim(
      clusterKinds.includes(object.kind) || object.metadata.namespace === namespace,
      `${nameOf(object)} is in another namespace`)),
    ...forPods(objects, (pod, workload) => [
      ...claim(matches(workload.spec.selector, labelsOf(workload)), 'does not select its pods'),
      ...claim(accounts.includes(pod.serviceAccountName), 'has no service account'),
    ]),
    ...forContainers(objects, (container) =>
      (container.envFrom ?? []).flatMap(({ configMapRef }) =>
        claim(configured.includes(configMapRef.name), `${configMapRef.name} does not exist`))),
    ...ofKind(objects, 'Service').flatMap((service) =>
      claim(selects({ matchLabels: service.spec.selector }), `${nameOf(service)} selects no pod`)),
    ...ofKind(objects, 'PodDisruptionBudget').flatMap((budget) =>
      claim(selects(budget.spec.selector), `${nameOf(budget)} selects no pod`)),
    ...ofKind(objects, 'NetworkPolicy').flatMap((policy) =>
      claim(concerns(policy.spec.podSelector), `${nameOf(policy)} selects no pod`)),
  ];
}

// One server stays while nodes are drained, and servers that fail keep no node from it.
export function drainable(objects) {
  return ofKind(objects, 'PodDisruptionBudget').flatMap((budget) => [
    ...claim(budget.spec.maxUnavailable === 1, `${nameOf(budget)} permits another number than one`),
    ...claim(budget.spec.unhealthyPodEvictionPolicy === 'AlwaysAllow',
      `${nameOf(budget)} holds pods that are not ready`),
  ]);
}

const secondsOf = (duration) => Number(/^(\d+)s$/.exec(duration)[1]);

// Kubernetes waits for as long as the programs may take to stop: for calls under way, and for
// workers of the server's own.
export function stopsInTime(objects) {
  return forContainers(objects, (container, pod) => {
    const grace = flagOf(container, 'grace');
    if (!grace) return [];
    const sleep = Number(container.lifecycle?.preStop?.exec?.command[1] ?? 0);
    const rounds = flagOf(container, 'workers') === '0' ? 1 : 2;
    return [
      ...claim(sleep > 0, 'is stopped while others still take it for an endpoint'),
      ...claim(sleep + rounds * secondsOf(grace) + 5 <= pod.terminationGracePeriodSeconds,
        'is killed before --grace is over'),
    ];
  });
}

export function probed(objects) {
  return forContainers(objects, (container, pod, workload) => {
    if (isWorker(workload)) {
      return [
        ...claim(container.readinessProbe?.exec?.command.includes('--check'), 'has no readiness'),
        ...claim(!container.livenessProbe, 'is restarted while its store is away'),
      ];
    }
    if (container.name !== 'server') return claim(container.readinessProbe, 'has no readiness');
    const tls = flagOf(container, 'tls-cert');
    const { startupProbe, readinessProbe, livenessProbe } = container;
    return [
      ...claim(startupProbe?.httpGet?.path === '/readyz', 'starts without its stores'),
      ...claim(tls ? readinessProbe?.exec?.command.includes(`--tls-cert=${tls}`) :
        readinessProbe?.grpc?.port === 50051, 'its readiness is not that of gRPC'),
      ...claim(livenessProbe?.httpGet?.path === '/healthz', 'its liveness is not that of HTTP'),
    ];
  });
}

// A worker can hold a job of --memory beside itself; a fifth more is for what is not the job's.
export function workersHoldTheirJobs(objects) {
  return forContainers(objects, (container, pod, workload) => {
    if (!isWorker(workload)) return [];
    const { limits, requests } = container.resources;
    return [
      ...claim(1.25 * bytesOf(flagOf(container, 'memory')) <= bytesOf(limits.memory),
        'a job of --memory does not fit into its limit'),
      ...claim(limits.memory === requests.memory, 'its memory may be given to others'),
      ...claim(workload.spec.replicas === undefined, 'its number would be reset when applied'),
    ];
  });
}

export const rules = [confined, limited, versioned, disksLimited, secretsByReference, connected,
  deniedByDefault, permittedByBothEnds, namesResolved, servicesReached, drainable, stopsInTime,
  probed, workersHoldTheirJobs];

export const violations = (objects) => rules.flatMap((rule) => rule(objects));
