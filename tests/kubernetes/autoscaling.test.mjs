// Autoscalers fit the classes of workers.
import assert from 'node:assert/strict';
import test from 'node:test';
import { adapterRules, classes, podAutoscalers, scaledObjects } from './autoscalers.mjs';

const words = (query) => query.replaceAll(/\s+/g, '');

for (const { name, deployment, gib, above } of classes()) {
  const [scaled, ...more] = scaledObjects(name);
  const [autoscaler, ...others] = podAutoscalers(name);
  const { query } = scaled.spec.triggers[0].metadata;

  test(`${name} has one autoscaler of each kind`, () => {
    assert.equal(more.length + others.length, 0);
    assert.equal(scaled.spec.scaleTargetRef.name, deployment);
    assert.equal(scaled.spec.triggers.length, 1);
    assert.equal(autoscaler.spec.metrics.length, 1);
    assert.equal(scaled.spec.maxReplicaCount, autoscaler.spec.maxReplicas);
    const { behavior } = scaled.spec.advanced.horizontalPodAutoscalerConfig;
    assert.deepEqual(behavior, autoscaler.spec.behavior);
  });

  test(`${name} is asked for by its memory and that of the next smaller class`, () =>
    assert.deepEqual([...query.matchAll(/memory="(\w+)"/g)].map(([, memory]) => memory),
      above ? [`${gib}GiB`, `${above}GiB`] : [`${gib}GiB`]));

  test(`${name} has the same query with both`, () => {
    const rules = adapterRules(autoscaler.spec.metrics[0].external.metric.name);
    assert.equal(rules.length, 1);
    assert.equal(words(rules[0].metricsQuery), words(query));
  });
}
