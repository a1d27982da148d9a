/** The last values of something that is measured often. */
export class Meter {
  private readonly values: Float64Array;
  private count = 0;

  constructor(size = 600) {
    this.values = new Float64Array(size);
  }

  add(value: number): void {
    this.values[this.count++ % this.values.length] = value;
  }

  clear(): void {
    this.count = 0;
  }

  get mean(): number {
    const used = this.used();
    return used.length ? used.reduce((total, value) => total + value, 0) / used.length : 0;
  }

  /** `share` from 0 to 1; 0 if nothing was measured. */
  percentile(share: number): number {
    const sorted = this.used().sort();
    return sorted.length
      ? sorted[Math.min(sorted.length - 1, Math.floor(share * sorted.length))]!
      : 0;
  }

  private used(): Float64Array {
    return this.values.slice(0, Math.min(this.count, this.values.length));
  }
}

/** Events in the last seconds. */
export class Rate {
  private readonly times: number[] = [];

  constructor(private readonly spanMs = 1000) {}

  add(nowMs: number): void {
    this.times.push(nowMs);
    this.forget(nowMs);
  }

  perSecond(nowMs: number): number {
    this.forget(nowMs);
    return (this.times.length * 1000) / this.spanMs;
  }

  private forget(nowMs: number): void {
    while (this.times.length && this.times[0]! < nowMs - this.spanMs) this.times.shift();
  }
}
