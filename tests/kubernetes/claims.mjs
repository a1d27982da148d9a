// What the rules have in common: pods, selectors, and claims about them.
import { nameOf, workloadsOf } from './manifests.mjs';

// A pod that calls the servers from their namespace. No manifest has one.
export const client = { name: 'a client', labels: { 'liquidblend-client': 'true' } };

const podOf = (workload) => workload.spec.template.spec;
export const labelsOf = (workload) => workload.spec.template.metadata.labels;
export const podsOf = (objects) => [client, ...workloadsOf(objects).map((workload) =>
  ({ name: nameOf(workload), labels: labelsOf(workload) }))];

// claim(is, text): text, if it is not so.
export const claim = (is, text) => (is ? [] : [text]);

export function forPods(objects, check) {
  return workloadsOf(objects).flatMap((workload) =>
    check(podOf(workload), workload).map((text) => `${nameOf(workload)}: ${text}`));
}

export function forContainers(objects, check) {
  return forPods(objects, (pod, workload) =>
    [...(pod.initContainers ?? []), ...pod.containers].flatMap((container) =>
      check(container, pod, workload).map((text) => `${container.name}: ${text}`)));
}

export function matches(selector, labels) {
  const equal = Object.entries(selector.matchLabels ?? {}).every(([key, value]) =>
    labels[key] === value);
  return equal && (selector.matchExpressions ?? []).every(({ key, operator, values }) => {
    if (!['In', 'NotIn'].includes(operator)) throw new Error(`unknown operator: ${operator}`);
    return values.includes(labels[key]) === (operator === 'In');
  });
}
