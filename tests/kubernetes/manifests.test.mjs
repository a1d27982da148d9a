// Every overlay is rendered and checked; every check notices what it is for.
import assert from 'node:assert/strict';
import { execFileSync } from 'node:child_process';
import { BlockList } from 'node:net';
import test from 'node:test';
import { flagOf, folder, isWorker, ofKind, overlays, page, parse, render, renderExamples,
  workloadsOf } from './manifests.mjs';
import { container, mistakes, policy, server } from './mistakes.mjs';
import * as rule from './rules.mjs';
import { schemaErrors, unknownFields } from './schemas.mjs';

const rendered = new Map(overlays.map((name) => [name, render(`overlays/${name}`)]));
const trialSecrets = parse(execFileSync(`${folder}/make-secrets.sh`, { encoding: 'utf8' }));
const scalers = [...render('autoscaling/keda'), ...render('autoscaling/hpa')];
const access = render('autoscaling/prometheus-access');
const examples = renderExamples();
const everything = [...rendered.values(), ...examples.values(), trialSecrets, access, scalers]
  .flat();

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
