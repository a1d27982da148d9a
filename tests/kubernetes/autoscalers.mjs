// The autoscalers of deploy/kubernetes, by class of workers.
import { readFileSync } from 'node:fs';
import { parse as parseYaml } from 'yaml';
import { bytesOf, flagOf, folder, isWorker, render, workloadsOf } from './manifests.mjs';

// Classes of many-machines, the smallest first: {name, gib, above}, above: of the next smaller one.
export function classes() {
  const found = workloadsOf(render('overlays/many-machines')).filter(isWorker).map((workload) => ({
    name: workload.metadata.labels['liquidblend-class'],
    deployment: workload.metadata.name,
    gib: bytesOf(flagOf(workload.spec.template.spec.containers[0], 'memory')) / 2 ** 30,
  })).sort((one, other) => one.gib - other.gib);
  return found.map((one, k) => ({ ...one, above: found[k - 1]?.gib ?? 0 }));
}

const ofClass = (objects, name) =>
  objects.filter(({ spec }) => spec.scaleTargetRef.name === `liquidblend-worker-${name}`);

export const scaledObjects = (name) => ofClass(render('autoscaling/keda'), name);
export const podAutoscalers = (name) => ofClass(render('autoscaling/hpa'), name);

// The rule of prometheus-adapter for a metric.
export function adapterRules(metric) {
  const { externalRules } =
    parseYaml(readFileSync(`${folder}/autoscaling/hpa/adapter-rules.yaml`, 'utf8'));
  return externalRules.filter(({ name }) => name.as === metric);
}
