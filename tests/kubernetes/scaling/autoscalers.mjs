// What Kubernetes' autoscaler and KEDA do with a metric, as their documentation and sources have it,
// on a target {replicas}. Times are seconds.
const tolerance = 0.1;  // of kube-controller-manager, as are the defaults of behavior
const defaultUp = { stabilizationWindowSeconds: 0, selectPolicy: 'Max', policies: [
  { type: 'Pods', value: 4, periodSeconds: 15 }, { type: 'Percent', value: 100, periodSeconds: 15 }] };
const defaultDown = { stabilizationWindowSeconds: 300, selectPolicy: 'Max', policies: [
  { type: 'Percent', value: 100, periodSeconds: 15 }] };

// HorizontalPodAutoscaler (autoscaling/v2) on one External metric with an AverageValue.
export class PodAutoscaler {
  recommendations = [];  // {time, replicas}
  events = [];           // {time, change}

  constructor({ minReplicas, maxReplicas, behavior, averageValue }) {
    Object.assign(this, { minReplicas, maxReplicas, averageValue });
    this.up = { ...defaultUp, ...behavior?.scaleUp };
    this.down = { ...defaultDown, ...behavior?.scaleDown };
  }

  // metric: null if there is none, or an error.
  sync(time, metric, target) {
    if (target.replicas === 0 && this.minReplicas > 0) return;  // switched off
    if (metric === null) return;
    const proposed = this.stabilized(time, this.proposal(metric, target.replicas), target.replicas);
    const replicas = this.limited(time, proposed, target.replicas);
    if (replicas === target.replicas) return;
    this.events.push({ time, change: replicas - target.replicas });
    target.replicas = replicas;
  }

  proposal(metric, replicas) {
    const ratio = metric / (this.averageValue * replicas);
    return Math.abs(1 - ratio) <= tolerance ? replicas : Math.ceil(metric / this.averageValue);
  }

  // Neither below the least recommendation of the window for scaling up, nor above the largest of
  // the window for scaling down.
  stabilized(time, proposed, replicas) {
    const within = (seconds) => this.recommendations
      .filter((one) => one.time > time - seconds).map((one) => one.replicas);
    const least = Math.min(proposed, ...within(this.up.stabilizationWindowSeconds));
    const most = Math.max(proposed, ...within(this.down.stabilizationWindowSeconds));
    this.recommendations.push({ time, replicas: proposed });
    return Math.min(Math.max(replicas, least), most);
  }

  limited(time, proposed, replicas) {
    const added = (seconds) => this.events.filter((one) => one.time > time - seconds)
      .reduce((sum, { change }) => sum + change, 0);
    const bound = (rules, sign, pick) => {
      if (rules.selectPolicy === 'Disabled') return replicas;
      return pick(...rules.policies.map(({ type, value, periodSeconds }) => {
        const before = replicas - added(periodSeconds);
        if (type === 'Pods') return before + sign * value;
        const share = before * (1 + sign * value / 100);
        return sign > 0 ? Math.ceil(share) : Math.trunc(share);
      }));
    };
    if (proposed > replicas) {
      const pick = this.up.selectPolicy === 'Min' ? Math.min : Math.max;
      const most = Math.min(this.maxReplicas, Math.max(replicas, bound(this.up, 1, pick)));
      return Math.min(proposed, most);
    }
    const pick = this.down.selectPolicy === 'Min' ? Math.max : Math.min;
    const least = Math.max(this.minReplicas, Math.min(replicas, bound(this.down, -1, pick)));
    return Math.max(proposed, least);
  }
}

// ScaledObject (KEDA 2) with one trigger: from 0 to 1 and back to 0 itself, between 1 and the
// maximum by an autoscaler that it makes.
export class Keda {
  lastActive = -Infinity;

  constructor({ spec }) {
    const { metadata } = spec.triggers[0];
    this.minReplicas = spec.minReplicaCount ?? 0;
    this.cooldown = spec.cooldownPeriod ?? 300;
    this.activation = Number(metadata.activationThreshold ?? 0);
    this.withoutMetric = metadata.ignoreNullValues === 'false' ? null : 0;
    this.autoscaler = new PodAutoscaler({
      minReplicas: Math.max(1, this.minReplicas),
      maxReplicas: spec.maxReplicaCount ?? 100,
      averageValue: Number(metadata.threshold),
      behavior: spec.advanced?.horizontalPodAutoscalerConfig?.behavior,
    });
  }

  poll(time, found, target) {
    const metric = found ?? this.withoutMetric;
    if (metric === null) return;
    if (metric > this.activation) {
      this.lastActive = time;
      if (target.replicas === 0) target.replicas = Math.max(1, this.minReplicas);
    } else if (this.minReplicas === 0 && time > this.lastActive + this.cooldown) {
      target.replicas = 0;
    }
  }

  sync(time, found, target) {
    this.autoscaler.sync(time, found ?? this.withoutMetric, target);
  }
}
