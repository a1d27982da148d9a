// Every overlay is rendered and checked; every check notices what it is for.
import assert from 'node:assert/strict';
import { execFileSync } from 'node:child_process';
import { BlockList } from 'node:net';
import test from 'node:test';
import { flagOf, folder, isWorker, ofKind, overlays, page, parse, render, renderExamples,
  workloadsOf } from './manifests.mjs';
import * as rule from './rules.mjs';
import { schemaErrors, unknownFields } from './schemas.mjs';

const rendered = new Map(overlays.map((name) => [name, render(`overlays/${name}`)]));
const trialSecrets = parse(execFileSync(`${folder}/make-secrets.sh`, { encoding: 'utf8' }));
const scalers = [...render('autoscaling/keda'), ...render('autoscaling/hpa')];
const access = render('autoscaling/prometheus-access');
const examples = renderExamples();
const everything = [...rendered.values(), ...examples.values(), trialSecrets, access, scalers]
  .flat();

const policy = (objects, name) =>
  ofKind(objects, 'NetworkPolicy').find(({ metadata }) => metadata.name === name);

for (const [name, objects] of rendered) {
  test(`${name} keeps the rules`, () => assert.deepEqual(rule.violations(objects), []));
}

for (const [name, objects] of examples) {
  test(`the example "${name}" names its images, and keeps the other rules`, () => {
    const registry = 'registry.example.org/liquidblend-';
    const copy = structuredClone(objects);
    for (const workload of workloadsOf(copy)) {
      const [first] = workload.spec.template.spec.containers;
      assert.ok(first.image.startsWith(registry), first.image);
      first.image = first.image.replace('registry.example.org', 'localhost');
    }
    assert.deepEqual(rule.violations(copy), []);
  });
}

test('the example of many machines reaches its own stores alone', () => {
  const text = JSON.stringify(examples.get('studio'));
  assert.doesNotMatch(text, /192\.0\.2\.|s3\.example\.org/);
  assert.match(text, /10\.20\.0\.10/);
  assert.match(text, /s3:\/\/studio/);
});

// deploy/images/build.sh gives images their labels and programs their commit.
test('the page builds and pushes the images of all overlays, by build.sh', () => {
  const [, built, pushed, version] = page().match(
    /^deploy\/images\/build\.sh (.*)\nfor target in (.*); do\n  podman push \S+:(\S+) /m);
  const images = [...rendered.values()].flatMap(workloadsOf)
    .flatMap((workload) => workload.spec.template.spec.containers.map(({ image }) => image));
  const named = built.split(' ').map((name) => `localhost/liquidblend-${name}:${version}`);
  assert.deepEqual(named.sort(), [...new Set(images)].sort());
  assert.equal(pushed, built);
});

test('the examples of stores permit those that they describe', () => {
  const peers = (name) => policy(examples.get(name), 'stores').spec.egress.map(({ to }) => to[0]);
  for (const peer of peers('inside')) assert.ok(peer.namespaceSelector && peer.podSelector);
  const [database, s3] = peers('public');
  assert.deepEqual(database, peers('studio')[0]);
  const excepted = new BlockList();
  for (const block of s3.ipBlock.except) {
    const [network, prefix] = block.split('/');
    excepted.addSubnet(network, Number(prefix));
  }
  const closed = ['10.96.0.1', '100.64.0.1', '169.254.169.254', '172.31.0.1', '192.168.0.1'];
  for (const address of closed) assert.ok(excepted.check(address), address);
  for (const address of ['52.216.0.1', '172.32.0.1']) assert.ok(!excepted.check(address), address);
});

test('the examples of traces have a policy for the port of their collector', () => {
  for (const name of ['traced', 'single']) {
    const [endpoint] = JSON.stringify(examples.get(name)).match(/http:\/\/otel-collector[^"]*/);
    const [{ ports }] = policy(examples.get(name), 'tracing').spec.egress;
    assert.deepEqual(ports, [{ protocol: 'TCP', port: Number(new URL(endpoint).port) }]);
  }
});

test('the account of Prometheus may find pods of the namespace, and nothing else', () => {
  const [role] = ofKind(access, 'Role');
  const [binding] = ofKind(access, 'RoleBinding');
  assert.deepEqual(role.rules,
    [{ apiGroups: [''], resources: ['pods'], verbs: ['get', 'list', 'watch'] }]);
  assert.equal(role.metadata.namespace, 'liquidblend');
  assert.equal(binding.metadata.namespace, 'liquidblend');
  assert.equal(binding.roleRef.name, role.metadata.name);
  const [{ from: [peer] }] = policy(rendered.get('many-machines'), 'server').spec.ingress.slice(1);
  assert.equal(binding.subjects[0].namespace,
    peer.namespaceSelector.matchLabels['kubernetes.io/metadata.name']);
});

test('the example of autoscalers names another Prometheus, for all classes', () => {
  const addresses = (objects) => ofKind(objects, 'ScaledObject')
    .map(({ spec }) => spec.triggers[0].metadata.serverAddress);
  const [address, ...others] = new Set(addresses(examples.get('scaling')));
  assert.equal(others.length, 0);
  assert.ok(!addresses(scalers).includes(address));
  const accounts = [access, examples.get('scaling')]
    .map((objects) => ofKind(objects, 'RoleBinding')[0].subjects[0].name);
  assert.notEqual(accounts[0], accounts[1]);
});

test('all values are as the schemas have them', async () =>
  assert.deepEqual(await schemaErrors(everything), []));

test('all fields are known', () => assert.deepEqual(unknownFields(everything), []));

test('the secrets of a trial are those that its manifests name', () => {
  const keys = new Map(trialSecrets.map(({ metadata, stringData }) =>
    [metadata.name, Object.keys(stringData)]));
  for (const workload of workloadsOf(rendered.get('trial'))) {
    const { containers: [container], volumes } = workload.spec.template.spec;
    for (const { valueFrom } of container.env.filter(({ valueFrom }) => valueFrom)) {
      assert.ok(keys.get(valueFrom.secretKeyRef.name).includes(valueFrom.secretKeyRef.key));
    }
    for (const { secret } of volumes.filter(({ secret }) => secret)) {
      assert.ok(keys.has(secret.secretName));
    }
  }
});

test('a trial has its stores, and nothing else goes to those of many-machines', () => {
  const peers = (name) => policy(rendered.get(name), 'stores').spec.egress.flatMap(({ to }) => to);
  assert.ok(peers('many-machines').every(({ ipBlock }) => ipBlock));
  assert.ok(peers('trial').every(({ podSelector }) => podSelector));
  const [config] = ofKind(rendered.get('trial'), 'ConfigMap');
  const host = new URL(config.data.AWS_ENDPOINT_URL).hostname;
  assert.ok(ofKind(rendered.get('trial'), 'Service').some(({ metadata }) => metadata.name === host));
});

test('with TLS all is as without, but for TLS and tokens', () => {
  const argumentsOf = (name) => rendered.get(name).find(({ kind, metadata }) =>
    kind === 'Deployment' && metadata.name === 'liquidblend-server').spec.template.spec
    .containers[0].args;
  const plain = argumentsOf('many-machines');
  const secure = argumentsOf('many-machines-tls');
  assert.deepEqual(secure.slice(0, plain.length), plain);
  assert.deepEqual(secure.slice(plain.length).map((argument) => argument.split('=')[0]),
    ['--tls-cert', '--tls-key', '--tokens']);
});

test('classes of workers differ in size alone', () => {
  const workers = workloadsOf(rendered.get('many-machines')).filter(isWorker);
  assert.equal(workers.length, 3);
  const alike = workers.map((workload) => {
    const copy = structuredClone(workload);
    const pod = copy.spec.template.spec;
    delete pod.containers[0].resources;
    pod.containers[0].args = pod.containers[0].args.map((argument) => argument.split('=')[0]);
    pod.volumes.forEach((volume) => delete volume.emptyDir?.sizeLimit);
    return JSON.stringify(copy).replaceAll(workload.metadata.labels['liquidblend-class'], 'class');
  });
  assert.equal(new Set(alike).size, 1);
  assert.equal(new Set(workers.map((workload) =>
    flagOf(workload.spec.template.spec.containers[0], 'memory'))).size, 3);
});

// What each check must notice, in a copy of many-machines.
const server = (objects) => workloadsOf(objects).find((workload) => !isWorker(workload));
const pod = (objects) => server(objects).spec.template.spec;
const container = (objects) => pod(objects).containers[0];
const worker = (objects) => workloadsOf(objects).find(isWorker);
const replace = (objects, flag, value) => {
  const { args } = container(objects);
  args[args.findIndex((argument) => argument.startsWith(`--${flag}=`))] = `--${flag}=${value}`;
};
const mistakes = {
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

for (const [name, ways] of Object.entries(mistakes)) {
  for (const [what, make] of Object.entries(ways)) {
    test(`${name} notices: ${what}`, () => {
      const objects = structuredClone(rendered.get('many-machines'));
      make(objects);
      assert.notDeepEqual(rule[name](objects), []);
    });
  }
}

test('each rule is shown to notice something', () =>
  assert.deepEqual(rule.rules.map(({ name }) => name).sort(), Object.keys(mistakes).sort()));

test('schemas and types notice mistakes', async () => {
  const copy = () => structuredClone([...rendered.get('many-machines'), ...scalers]);
  const wrong = copy();
  wrong.at(-1).spec.maxReplicas = 'many';
  delete ofKind(wrong, 'ScaledObject')[0].spec.triggers;
  server(wrong).apiVersion = 'apps/v9';
  assert.equal((await schemaErrors(wrong)).length, 3);
  const unknown = copy();
  container(unknown).readynessProbe = {};
  ofKind(unknown, 'ScaledObject')[0].spec.cooldown = 5;
  ofKind(unknown, 'NetworkPolicy')[0].spec.policyType = [];
  assert.equal(unknownFields(unknown).length, 3);
});
