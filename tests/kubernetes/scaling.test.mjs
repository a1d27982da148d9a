// The autoscalers of deploy/kubernetes over a day of jobs: their queries by a real Prometheus on the
// metrics of a real catalog. Then with mistakes, which must show.
//   REPLAY_CATALOG, PROMETHEUS, KUBECTL   programs
import assert from 'node:assert/strict';
import { readFileSync } from 'node:fs';
import test from 'node:test';
import { adapterRules, classes, podAutoscalers, scaledObjects } from './autoscalers.mjs';
import { parse, root } from './manifests.mjs';
import { Keda, PodAutoscaler } from './scaling/autoscalers.mjs';
import { properties } from './scaling/properties.mjs';
import { simulate } from './scaling/simulation.mjs';
import { day, end, catalogAway, serverAway, tooLarge } from './scaling/trace.mjs';

const withKeda = (change = (scaled) => scaled) => classes().map((one) => {
  const scaled = change(scaledObjects(one.name)[0], one);
  const { query } = scaled.spec.triggers[0].metadata;
  return { ...one, least: 0, most: scaled.spec.maxReplicaCount, query,
    autoscaler: new Keda(scaled) };
});

const withPodAutoscaler = () => classes().map((one) => {
  const { spec } = podAutoscalers(one.name)[0];
  const { metric, target } = spec.metrics[0].external;
  return { ...one, least: spec.minReplicas, most: spec.maxReplicas,
    query: adapterRules(metric.name)[0].metricsQuery,
    autoscaler: new PodAutoscaler({ ...spec, averageValue: Number(target.averageValue) }) };
});

// The query of deploy/monitoring for jobs that are too large.
const tooLargeQuery = parse(readFileSync(
  `${root}deploy/monitoring/prometheus/rules/liquidblend-recording.yml`, 'utf8'))[0].groups
  .flatMap(({ rules }) => rules)
  .find(({ record }) => record === 'job:liquidblend_jobs_above_classes:max').expr;

// What is not true, as "class: property".
async function violations(scaled, trace, times, t) {
  const { classes: results, ...rest } = await simulate(scaled, trace, times, tooLargeQuery);
  results.forEach(({ deployment, samples }, k) => {
    const sum = (key) => samples.reduce((total, sample) => total + sample[key], 0);
    t?.diagnostic(`${scaled[k].name}: up to ${Math.max(...samples.map(({ jobs }) => jobs))} jobs, ` +
      `${Math.max(...samples.map(({ replicas }) => replicas))} workers; ${deployment.started} ` +
      `started, ${deployment.interrupted} stopped at work; ` +
      `${(sum('replicas') / sum('jobs')).toFixed(2)} of a worker for each job`);
  });
  const found = results.flatMap((result, k) => properties.flatMap((property) => {
    const times_ = property(result, { ...scaled[k], ...times });
    return times_.length ? [`${scaled[k].name}: ${property.name} at ${times_[0]} s`] : [];
  }));
  return { found, ...rest };
}

const valueOf = (text, series) =>
  Number(text.split('\n').find((line) => line.startsWith(`${series} `)).split(' ')[1]);

for (const [name, scaled] of [['KEDA', withKeda], ["Kubernetes' autoscaler", withPodAutoscaler]]) {
  test(`with ${name} all is done, and nothing flaps, stays or is missed`, async (t) => {
    const { found, text, value } = await violations(scaled(), day(1),
      { end, catalogAway, serverAway }, t);
    assert.deepEqual(found, []);
    assert.equal(valueOf(text, 'liquidblend_jobs{state="queued"}'), 1);  // tooLarge
    assert.equal(valueOf(text, 'liquidblend_jobs{state="running"}'), 0);
    assert.equal(value, 1);
  });
}

const morning = day(1).filter(({ time }) => time < 1260);
const untilNoon = { end: 2700 };
const mistake = (change) => withKeda((scaled, one) => {
  const changed = structuredClone(scaled);
  change(changed.spec.triggers[0].metadata, one);
  return changed;
});
const mistakes = {
  'a sum over servers': ['countsOnce', (metadata) => {
    metadata.query = metadata.query.replace('max(', 'sum(');
  }],
  'queued jobs alone': ['flaps', (metadata) => {
    metadata.query = metadata.query.replaceAll('{job', '{state="queued",job');
  }],
  'jobs of smaller classes': ['countsOnce', (metadata, { gib }) => {
    metadata.query = `max(sum by (instance) (liquidblend_jobs_within_memory{memory="${gib}GiB"}))`;
  }],
  'jobs of any size': ['empties', (metadata) => {
    metadata.query = metadata.query.replace('64GiB', 'any');
  }],
  'a class that begins with its second job': ['comesBack', (metadata) => {
    metadata.activationThreshold = '1';
  }],
  'a worker for two jobs': ['follows', (metadata) => {
    metadata.threshold = '2';
  }],
  'zero where there is no figure': ['keepsStill', (metadata) => {
    metadata.ignoreNullValues = 'true';
  }, { catalogAway: { begin: 600, end: 1020 } }],
};
for (const [what, [property, change, times]] of Object.entries(mistakes)) {
  test(`${property} notices: ${what}`, async () => {
    const { found } = await violations(mistake(change), morning,
      { ...untilNoon, ...times });
    assert.ok(found.some((text) => text.includes(property)), found.join('; ') || 'nothing');
  });
}

test('each property is shown to notice something', () =>
  assert.deepEqual([...new Set(Object.values(mistakes).map(([property]) => property))].sort(),
    properties.map(({ name }) => name).sort()));

test('the rules of deploy/monitoring know the largest class', () => {
  const largest = Math.max(...classes().map(({ gib }) => gib));
  assert.ok(tooLargeQuery.includes(`memory="${largest}GiB"`), tooLargeQuery);
});

test('the trace has a job that is too large for every class', () =>
  assert.ok(classes().every(({ gib }) => gib < tooLarge.gib)));
