/** Pauses between tries: each twice as long as the one before, a little at random. */
export class BackOff {
  private tries = 0;

  constructor(
    private readonly firstMs = 250,
    private readonly longestMs = 8000,
    private readonly random = Math.random,
  ) {}

  /** Milliseconds until the next try. */
  next(): number {
    const pause = Math.min(this.longestMs, this.firstMs * 2 ** this.tries);
    ++this.tries;
    return pause * (0.75 + 0.5 * this.random());
  }

  reset(): void {
    this.tries = 0;
  }
}
