// How finely it is drawn while it moves: fewer pixels and triangles where drawing is too slow.
const slowMs = 42;
const fastMs = 24;
const patience = 12; // frames
const highestRatio = 2;

/** From the finest to the coarsest: share of the pixels' density, and level of detail. */
const rungs: [number, number][] = [
  [1, 0],
  [0.8, 0],
  [0.8, 1],
  [0.64, 1],
  [0.64, 2],
  [0.5, 2],
];

export class Effort {
  private rung = 0;
  private balance = 0;
  private lastStep = 0;
  private finerAfter = 10 * patience; // frames

  get level(): number {
    return rungs[this.rung]![1];
  }

  /** Pixels of the picture for each one of CSS. */
  ratio(still: boolean): number {
    const device = Math.min(highestRatio, globalThis.devicePixelRatio || 1);
    return still ? device : Math.max(0.5, device * rungs[this.rung]![0]);
  }

  /** Learns how long a picture waited for its turn. Returns whether something changed. */
  measure(waitedMs: number): boolean {
    if (waitedMs > slowMs) this.balance += Math.min(4, waitedMs / slowMs);
    else if (waitedMs < fastMs) --this.balance;
    if (this.balance > patience) return this.step(1);
    if (this.balance < -this.finerAfter) return this.step(-1);
    return false;
  }

  // A finer step that had to be taken back is tried again later and later.
  private step(by: number): boolean {
    const before = this.rung;
    if (by > 0 && this.lastStep < 0) this.finerAfter *= 2;
    this.lastStep = by;
    this.rung = Math.min(rungs.length - 1, Math.max(0, before + by));
    this.balance = 0;
    return this.rung !== before;
  }
}
