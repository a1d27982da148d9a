// Which pods Prometheus scrapes by autoscaling/prometheus.yaml, and as what: promtool relabels pods
// that are listed as Kubernetes lists them.
//   PROMTOOL   a program
import assert from 'node:assert/strict';
import { execFileSync } from 'node:child_process';
import { mkdtempSync, readFileSync, rmSync, writeFileSync } from 'node:fs';
import { tmpdir } from 'node:os';
import test from 'node:test';
import { parse, stringify } from 'yaml';
import { folder } from './manifests.mjs';

const pods = [
  { name: 'serves', component: 'server', phase: 'Running', ip: '10.0.0.1' },
  { name: 'starts', component: 'server', phase: 'Pending', ip: '10.0.0.2' },
  { name: 'evicted', component: 'server', phase: 'Failed', ip: '10.0.0.3' },
  { name: 'ended', component: 'server', phase: 'Succeeded', ip: '10.0.0.4' },
  { name: 'works', component: 'worker', phase: 'Running', ip: '10.0.0.5' },
  { name: 'other', phase: 'Running', ip: '10.0.0.6' },
];

const asListed = ({ name, component, phase, ip }) => ({
  targets: [ip],
  labels: {
    __meta_kubernetes_pod_name: name,
    __meta_kubernetes_pod_phase: phase,
    __meta_kubernetes_pod_ip: ip,
    ...(component && { __meta_kubernetes_pod_label_app_kubernetes_io_component: component }),
  },
});

// The labels of the targets that are left, by address: promtool has them in any order.
function targets(job) {
  const scratch = mkdtempSync(`${tmpdir()}/scrape-`);
  try {
    writeFileSync(`${scratch}/prometheus.yml`, stringify({ scrape_configs: [job] }));
    const found = execFileSync(process.env.PROMTOOL ?? 'promtool', ['check', 'service-discovery',
      '--timeout=1s', `${scratch}/prometheus.yml`, job.job_name], { encoding: 'utf8' });
    return JSON.parse(found).map(({ labels }) => labels).filter(({ __address__ }) => __address__)
      .sort((a, b) => (a.__address__ < b.__address__ ? -1 : 1));
  } finally {
    rmSync(scratch, { recursive: true });
  }
}

test('servers that may answer are scraped, by their address and name', () => {
  const { scrape_configs: [{ kubernetes_sd_configs: _, ...job }] } =
    parse(readFileSync(`${folder}/autoscaling/prometheus.yaml`, 'utf8'));
  const found = targets({ ...job, static_configs: pods.map(asListed) });
  assert.deepEqual(found.map(({ job, instance, pod }) => ({ job, instance, pod })), [
    { job: 'liquidblend', instance: '10.0.0.1:8080', pod: 'serves' },
    { job: 'liquidblend', instance: '10.0.0.2:8080', pod: 'starts' },
  ]);
});
