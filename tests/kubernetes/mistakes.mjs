// Mistakes in a copy of many-machines that each rule must notice, by the rule's name.
import { isWorker, ofKind, workloadsOf } from './manifests.mjs';

export const policy = (objects, name) =>
  ofKind(objects, 'NetworkPolicy').find(({ metadata }) => metadata.name === name);
export const server = (objects) => workloadsOf(objects).find((workload) => !isWorker(workload));
const pod = (objects) => server(objects).spec.template.spec;
export const container = (objects) => pod(objects).containers[0];
const worker = (objects) => workloadsOf(objects).find(isWorker);
const replace = (objects, flag, value) => {
  const { args } = container(objects);
  args[args.findIndex((argument) => argument.startsWith(`--${flag}=`))] = `--${flag}=${value}`;
};

export const mistakes = {
  confined: {
    'root': (all) => { pod(all).securityContext.runAsNonRoot = false; },
    'no seccomp': (all) => { delete pod(all).securityContext.seccompProfile; },
    'the network of the node': (all) => { pod(all).hostNetwork = true; },
    'a token': (all) => { delete pod(all).automountServiceAccountToken; },
    'service links': (all) => { delete pod(all).enableServiceLinks; },
    'a folder of the node': (all) => {
      pod(all).volumes.push({ name: 'all', hostPath: { path: '/' } });
    },
    'a root that is written': (all) => {
      container(all).securityContext.readOnlyRootFilesystem = false;
    },
    'privileges': (all) => { delete container(all).securityContext.allowPrivilegeEscalation; },
    'a capability': (all) => { container(all).securityContext.capabilities.add = ['NET_RAW']; },
    'no security at all': (all) => { delete container(all).securityContext; },
    'an open init container': (all) => { pod(all).initContainers = [{ name: 'first' }]; },
  },
  limited: {
    'no limit': (all) => { delete container(all).resources.limits.memory; },
    'no request': (all) => { delete container(all).resources.requests.cpu; },
    'no resources': (all) => { delete container(all).resources; },
  },
  versioned: {
    'latest': (all) => { container(all).image = 'localhost/liquidblend-server:latest'; },
    'no tag': (all) => { container(all).image = 'localhost/liquidblend-server'; },
    'an image of others': (all) => { container(all).image = 'liquidblend-server:0.3.0'; },
  },
  disksLimited: {
    'a volume without limit': (all) => { pod(all).volumes[0].emptyDir = {}; },
    'volumes beyond the limit': (all) => { pod(all).volumes[0].emptyDir.sizeLimit = '99Gi'; },
    'a cache as large as its volume': (all) => replace(all, 'cache-size', '24GiB'),
  },
  secretsByReference: {
    'a secret': (all) => all.push({ kind: 'Secret', metadata: { name: 'x', namespace: 'y' } }),
    'a secret that is unknown': (all) => {
      container(all).env[0].valueFrom.secretKeyRef.name = 'other';
    },
    'a password': (all) => { container(all).env[0] = { name: 'PGPASSWORD', value: 'x' }; },
  },
  connected: {
    'another namespace': (all) => { server(all).metadata.namespace = 'default'; },
    'a selector that fails': (all) => { server(all).spec.selector.matchLabels.x = 'y'; },
    'no account': (all) => { pod(all).serviceAccountName = 'other'; },
    'no configuration': (all) => { container(all).envFrom[0].configMapRef.name = 'other'; },
    'a service of nobody': (all) => { ofKind(all, 'Service')[0].spec.selector.x = 'y'; },
    'a budget of nobody': (all) => {
      ofKind(all, 'PodDisruptionBudget')[0].spec.selector.matchLabels.x = 'y';
    },
    'a policy of nobody': (all) => { policy(all, 'server').spec.podSelector.matchLabels.x = 'y'; },
  },
  deniedByDefault: {
    'only some are denied': (all) => {
      policy(all, 'deny-all').spec.podSelector = { matchLabels: { x: 'y' } };
    },
    'only ingress is denied': (all) => { policy(all, 'deny-all').spec.policyTypes = ['Ingress']; },
    'all is permitted': (all) => { policy(all, 'deny-all').spec.egress = [{}]; },
    'all ports': (all) => { delete policy(all, 'stores').spec.egress[0].ports; },
    'all peers': (all) => { delete policy(all, 'server').spec.ingress[0].from; },
  },
  permittedByBothEnds: {
    'clients that are not let out': (all) => {
      all.splice(all.indexOf(policy(all, 'client')), 1);
    },
    'clients without HTTP': (all) => { policy(all, 'client').spec.egress[0].ports.pop(); },
    'clients that are not let in': (all) => {
      policy(all, 'server').spec.ingress[0].from.shift();
    },
    'clients that nothing is permitted to': (all) => {
      all.splice(all.indexOf(policy(all, 'client')), 1);
      policy(all, 'server').spec.ingress.shift();
    },
  },
  namesResolved: {
    'no DNS': (all) => { all.splice(all.indexOf(policy(all, 'dns')), 1); },
    'clients without DNS': (all) => {
      policy(all, 'dns').spec.podSelector.matchExpressions =
        [{ key: 'app.kubernetes.io/component', operator: 'In', values: ['server', 'worker'] }];
    },
    'DNS without TCP': (all) => { policy(all, 'dns').spec.egress[0].ports.pop(); },
    'no cache of the node': (all) => { policy(all, 'dns').spec.egress[0].to.pop(); },
  },
  servicesReached: {
    'a store in a namespace that no policy names': (all) => {
      ofKind(all, 'ConfigMap')[0].data.AWS_ENDPOINT_URL = 'http://minio.objects.svc';
    },
    'a collector in a namespace that no policy names': (all) => {
      container(all).env.push({ name: 'URL', value: 'http://collector.tracing.svc:4318' });
    },
  },
  drainable: {
    'a budget that holds failing servers': (all) => {
      delete ofKind(all, 'PodDisruptionBudget')[0].spec.unhealthyPodEvictionPolicy;
    },
    'all servers at a time': (all) => {
      ofKind(all, 'PodDisruptionBudget')[0].spec.maxUnavailable = 2;
    },
  },
  stopsInTime: {
    'no preStop': (all) => { delete container(all).lifecycle; },
    'a long grace': (all) => replace(all, 'grace', '40s'),
    'a short period': (all) => { pod(all).terminationGracePeriodSeconds = 25; },
  },
  probed: {
    'no startup probe': (all) => { delete container(all).startupProbe; },
    'no readiness': (all) => { delete container(all).readinessProbe; },
    'liveness by the stores': (all) => { container(all).livenessProbe.httpGet.path = '/readyz'; },
    'no readiness of a worker': (all) => {
      delete worker(all).spec.template.spec.containers[0].readinessProbe;
    },
    'liveness of a worker': (all) => {
      const [first] = worker(all).spec.template.spec.containers;
      first.livenessProbe = first.readinessProbe;
    },
  },
  workersHoldTheirJobs: {
    'a limit without room': (all) => {
      worker(all).spec.template.spec.containers[0].resources.limits.memory = '4Gi';
    },
    'a request below the limit': (all) => {
      worker(all).spec.template.spec.containers[0].resources.requests.memory = '1Gi';
    },
    'a number of workers': (all) => { worker(all).spec.replicas = 2; },
  },
};
