// A simulated cluster: deployments of workers that take the jobs of a real catalog.
// Seconds.
const podStart = 20;            // until a new pod takes jobs
const lostToInterruption = 10;  // of work, at most: docs/operations/failures.md
const assembly = 20;            // of a registration after its children

class Pod {
  lease = null;

  constructor(name, ready) {
    Object.assign(this, { name, ready });
  }
}

// Workers of one class; `replicas` is what an autoscaler sets.
export class Deployment {
  replicas = 1;     // unless the manifest names a number
  pods = [];
  started = 0;      // pods so far
  interrupted = 0;  // stops in the middle of a job

  constructor(name, gib) {
    Object.assign(this, { name, gib });
  }
}

export class Cluster {
  waiting = [];         // of the trace
  submitted = 0;
  works = new Map();    // by id of a job: {seconds, gib}
  running = new Map();  // by lease: {pod, job, end}
  mayWork = true;       // whether the queue may have something for an idle worker

  constructor(catalog, deployments, trace) {
    Object.assign(this, { catalog, deployments, waiting: [...trace] });
  }

  // Everything that happens up to a time.
  async advance(time) {
    await this.catalog.ask(`at ${time}`);
    await this.finish(time);
    await this.submit(time);
    await this.follow(time);
    await this.giveWork(time);
  }

  async submit(time) {
    while (this.waiting.length && this.waiting[0].time <= time) {
      const { gib, seconds, targets = 0 } = this.waiting.shift();
      const name = `job${++this.submitted}`;
      const id = await this.catalog.ask(targets ? `register ${name} ${gib} ${targets}` :
        `import ${name} ${gib}`);
      this.works.set(id, { seconds: targets ? assembly : seconds, gib });
      for (let k = 0; k < targets; ++k) this.works.set(`${id}.${k}`, { seconds, gib });
      this.mayWork = true;
    }
  }

  async finish(time) {
    for (const [lease, { pod, job, end }] of this.running) {
      if (end > time) continue;
      await this.catalog.ask(`finish ${lease}`);
      this.works.delete(job);
      this.running.delete(lease);
      pod.lease = null;
      this.mayWork = true;
    }
  }

  // Pods follow the number of replicas. As Kubernetes does, pods that are not ready go first, then
  // the newest, whether they work or not.
  async follow(time) {
    for (const deployment of this.deployments) {
      const { pods, replicas } = deployment;
      while (pods.length < replicas) {
        pods.push(new Pod(`${deployment.name}-${++deployment.started}`, time + podStart));
        this.mayWork = true;
      }
      while (pods.length > replicas) await this.stop(deployment, time);
    }
  }

  async stop(deployment, time) {
    const pod = deployment.pods.pop();
    if (!pod.lease) return;
    const { job, end } = this.running.get(pod.lease);
    await this.catalog.ask(`release ${pod.lease}`);
    this.running.delete(pod.lease);
    const work = this.works.get(job);
    work.seconds = Math.min(work.seconds, end - time + lostToInterruption);
    ++deployment.interrupted;
    this.mayWork = true;
  }

  async giveWork(time) {
    if (!this.mayWork) return;
    this.mayWork = this.deployments.some(({ pods }) => pods.some(({ ready }) => ready > time));
    for (const { pods, gib } of this.deployments) {
      for (const pod of pods) {
        if (pod.lease || pod.ready > time) continue;
        const answer = await this.catalog.ask(`lease ${pod.name} ${gib}`);
        if (answer === '-') break;
        const [lease, job] = answer.split(' ');
        pod.lease = lease;
        this.running.set(lease, { pod, job, end: time + this.works.get(job).seconds });
      }
    }
  }

  // Jobs that are not done and need more than `above` and at most `gib`; of a registration its
  // children, and itself when they are done.
  open(above, gib) {
    const hasChildren = (id) => [...this.works.keys()]
      .some((other) => other.startsWith(`${id}.`));
    return [...this.works].filter(([id, work]) =>
      work.gib > above && work.gib <= gib && !hasChildren(id)).length;
  }
}
