// The manifests of deploy/kubernetes, rendered by kubectl (KUBECTL: another program than that).
import { execFileSync } from 'node:child_process';
import { mkdirSync, mkdtempSync, readFileSync, rmSync, symlinkSync, writeFileSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { fileURLToPath } from 'node:url';
import { parseAllDocuments } from 'yaml';

export const root = fileURLToPath(new URL('../..', import.meta.url));
export const folder = `${root}deploy/kubernetes`;
export const overlays = ['one-machine', 'many-machines', 'many-machines-tls', 'trial'];

export function parse(text) {
  return parseAllDocuments(text).map((document) => {
    if (document.errors.length) throw document.errors[0];
    return document.toJS();
  }).filter(Boolean);
}

// The objects of a folder with a kustomization, by default one below deploy/kubernetes. What kubectl
// says of fields that newer versions name otherwise is left out.
export function render(path, root_ = folder) {
  const program = process.env.KUBECTL ?? 'kubectl';
  return parse(execFileSync(program, ['kustomize', `${root_}/${path}`],
    { encoding: 'utf8', stdio: ['ignore', 'pipe', 'pipe'] }));
}

export const page = () => readFileSync(`${root}docs/operations/kubernetes.md`, 'utf8');

// The objects of the overlays that the page shows, by name: blocks of YAML that begin with
// "# OVERLAY/FILE".
export function renderExamples() {
  const scratch = mkdtempSync(`${tmpdir()}/examples-`);
  try {
    symlinkSync(root, `${scratch}/liquidblend`);
    const names = new Set();
    for (const [, name, file, text] of page().matchAll(/```yaml\n# (\w+)\/(\S+)\n(.*?)```/gs)) {
      mkdirSync(`${scratch}/${name}`, { recursive: true });
      writeFileSync(`${scratch}/${name}/${file}`, text);
      names.add(name);
    }
    return new Map([...names].map((name) => [name, render(name, scratch)]));
  } finally {
    rmSync(scratch, { recursive: true });
  }
}

export function projectVersion() {
  return /project\(liquidblend VERSION (\S+)/.exec(readFileSync(`${root}CMakeLists.txt`, 'utf8'))[1];
}

export const nameOf = (object) => `${object.kind} ${object.metadata?.name}`;
export const ofKind = (objects, kind) => objects.filter((object) => object.kind === kind);
export const workloadsOf = (objects) =>
  objects.filter((object) => ['Deployment', 'StatefulSet'].includes(object.kind));
export const isWorker = (workload) => workload.metadata.name.startsWith('liquidblend-worker-');

// The value of --FLAG=VALUE among the arguments of a container.
export function flagOf(container, flag) {
  const prefix = `--${flag}=`;
  return container.args?.find((argument) => argument.startsWith(prefix))?.slice(prefix.length);
}

const units = { Ki: 2 ** 10, Mi: 2 ** 20, Gi: 2 ** 30, KiB: 2 ** 10, MiB: 2 ** 20, GiB: 2 ** 30 };

// Bytes of "4Gi" (Kubernetes) or "4GiB" (our flags).
export function bytesOf(size) {
  const [, number, unit] = /^(\d+)([KMG]iB?)$/.exec(size);
  return Number(number) * units[unit];
}
