/** States that can be undone and done again. */
export class History<T> {
  private past: T[] = [];
  private future: T[] = [];

  constructor(
    private present: T,
    private readonly limit = 500,
  ) {}

  get value(): T {
    return this.present;
  }

  get canUndo(): boolean {
    return this.past.length > 0;
  }

  get canRedo(): boolean {
    return this.future.length > 0;
  }

  /** A new state; what was undone is gone. */
  push(value: T): void {
    if (value === this.present) return;
    this.past = [...this.past.slice(1 - this.limit), this.present];
    this.future = [];
    this.present = value;
  }

  /** Changes all states, those that were undone, too. */
  map(change: (state: T) => T): void {
    this.past = this.past.map(change);
    this.present = change(this.present);
    this.future = this.future.map(change);
  }

  undo(): void {
    const before = this.past.pop();
    if (before === undefined) return;
    this.future.push(this.present);
    this.present = before;
  }

  redo(): void {
    const next = this.future.pop();
    if (next === undefined) return;
    this.past.push(this.present);
    this.present = next;
  }
}
