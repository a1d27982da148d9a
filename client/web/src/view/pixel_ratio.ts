// How many pixels are drawn: fewer while it moves too slowly, more once it is still.
const slowMs = 42;
const fastMs = 24;
const lowest = 0.5;
const highest = 2;
const patience = 12;  // frames

export class PixelRatio {
  private factor = 1;
  private lastMs = 0;
  private balance = 0;

  /** By the processor, edges are smooth in the still picture only: it is drawn larger. */
  constructor(private readonly software: boolean) {}

  value(still: boolean): number {
    const device = Math.min(highest, globalThis.devicePixelRatio || 1);
    if (still) return this.software ? Math.min(highest, 2 * device) : device;
    return Math.max(lowest, Math.min(device, this.software ? 1 : device) * this.factor);
  }

  /** Learns from the pace of the pictures. Returns whether the ratio changed. */
  measure(nowMs: number): boolean {
    const passed = nowMs - this.lastMs;
    this.lastMs = nowMs;
    if (passed > 250) return false;  // it stood still
    this.balance += passed > slowMs ? 1 : passed < fastMs ? -1 : 0;
    if (this.balance > patience) return this.scale(0.8);
    if (this.balance < -8 * patience) return this.scale(1.25);
    return false;
  }

  private scale(by: number): boolean {
    const before = this.factor;
    this.factor = Math.min(1, Math.max(lowest, this.factor * by));
    this.balance = 0;
    return this.factor !== before;
  }
}
