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
  private lastMs = 0;
  private balance = 0;

  get level(): number {
    return rungs[this.rung]![1];
  }

  /** Pixels of the picture for each one of CSS. */
  ratio(still: boolean): number {
    const device = Math.min(highestRatio, globalThis.devicePixelRatio || 1);
    return still ? device : Math.max(0.5, device * rungs[this.rung]![0]);
  }

  /** Learns from the pace of the pictures. Returns whether something changed. */
  measure(nowMs: number): boolean {
    const passed = nowMs - this.lastMs;
    this.lastMs = nowMs;
    if (passed > 250) return false; // it stood still
    this.balance += passed > slowMs ? 1 : passed < fastMs ? -1 : 0;
    if (this.balance > patience) return this.step(1);
    if (this.balance < -10 * patience) return this.step(-1);
    return false;
  }

  private step(by: number): boolean {
    const before = this.rung;
    this.rung = Math.min(rungs.length - 1, Math.max(0, before + by));
    this.balance = 0;
    return this.rung !== before;
  }
}
