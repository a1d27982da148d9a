// The whole: a trace, a catalog, its metrics in two servers, Prometheus, autoscalers, workers.
import { mkdtempSync, rmSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { Catalog } from './catalog.mjs';
import { Cluster, Deployment } from './cluster.mjs';
import { Prometheus, seriesOf } from './prometheus.mjs';

const step = 5;       // seconds
const period = 15;    // of Prometheus, KEDA and Kubernetes' autoscaler
const epoch = 1700000000;

const isIn = (time, span) => Boolean(span) && time >= span.begin && time < span.end;

// Two servers on one catalog, as Prometheus sees them. The second one shows what the first one
// showed a scrape before, which is older than the 5 s for which a server keeps its figures.
class Servers {
  previous = [];
  shown = [[], []];

  // What Prometheus records at a time: series that are gone end.
  scrape(time, metrics, { catalogAway, serverAway }) {
    const now = isIn(time, catalogAway) ? [] : seriesOf(metrics)
      .filter(({ labels }) => labels.__name__.startsWith('liquidblend_jobs'));
    const series = [now, isIn(time, serverAway) ? [] : this.previous].map((each, k) =>
      each.map(({ labels, value }) =>
        ({ labels: { ...labels, job: 'liquidblend', instance: `server${k}:8080` }, value })));
    const nameOf = ({ labels }) => JSON.stringify(Object.entries(labels).sort());
    const ended = series.flatMap((each, k) => {
      const names = new Set(each.map(nameOf));
      return this.shown[k].filter((one) => !names.has(nameOf(one)))
        .map(({ labels }) => ({ labels, value: null }));
    });
    this.previous = now;
    this.shown = series;
    return [...series.flat(), ...ended];
  }
}

async function metricsOf(classes, prometheus, time) {
  return Promise.all(classes.map(async ({ query }) => {
    const values = await prometheus.values(query, epoch + time);
    if (values.length > 1) throw new Error(`${values.length} values of ${query}`);
    return values[0] ?? null;
  }));
}

// classes   {name, gib, above, query, autoscaler}: memory of the class and of the next smaller one
// trace     jobs
// times     `end`, and when the catalog or a server is away
// query     for its value at the end
// Returns {classes: [{deployment, samples: [{time, jobs, replicas}]}], text: the last metrics,
// value}; jobs: open ones that need the class.
export async function simulate(classes, trace, times, query) {
  const folder = mkdtempSync(`${tmpdir()}/scaling-`);
  const catalog = new Catalog(`${folder}/catalog.db`);
  const deployments = classes.map(({ name, gib }) => new Deployment(name, gib));
  const cluster = new Cluster(catalog, deployments, trace);
  const servers = new Servers();
  const prometheus = new Prometheus();
  const samples = classes.map(() => []);
  try {
    await prometheus.start(folder);
    let metrics = [];  // of the classes, at the last scrape; null: none
    for (let time = 0; time <= times.end; time += step) {
      await cluster.advance(time);
      classes.forEach(({ above, gib }, k) => samples[k].push(
        { time, jobs: cluster.open(above, gib), replicas: deployments[k].replicas }));
      if (time % period === 0) {
        await prometheus.write(servers.scrape(time, await catalog.metrics(), times), epoch + time);
        metrics = await metricsOf(classes, prometheus, time);
      }
      const act = { [step]: 'poll', [2 * step]: 'sync' }[time % period];
      if (act) classes.forEach(({ autoscaler }, k) =>
        autoscaler[act]?.(time, metrics[k], deployments[k]));
    }
    const [value] = query ? await prometheus.values(query, epoch + times.end) : [];
    return { text: await catalog.metrics(), value,
      classes: deployments.map((deployment, k) => ({ deployment, samples: samples[k] })) };
  } finally {
    catalog.close();
    if (prometheus.process) await prometheus.close();
    rmSync(folder, { recursive: true });
  }
}
