/**
 * Runs one request at a time. While one runs, the newest of the others waits; older ones are
 * forgotten. So the last request is always answered, and there is never a queue.
 */
export class NewestWins<Request> {
  private running: AbortController | undefined;
  private waiting: { request: Request } | undefined;
  private most = 0;

  constructor(private readonly run: (request: Request, signal: AbortSignal) => Promise<void>) {}

  get numRunning(): number {
    return this.running ? 1 : 0;
  }

  get numWaiting(): number {
    return this.waiting ? 1 : 0;
  }

  /** The most requests that ever waited. */
  get mostWaiting(): number {
    return this.most;
  }

  push(request: Request): void {
    this.waiting = { request };
    this.next();
    this.most = Math.max(this.most, this.numWaiting);
  }

  /** If a request waits, ends the one that runs. */
  hurry(): void {
    if (!this.waiting) return;
    this.end();
    this.next();
  }

  cancel(): void {
    this.waiting = undefined;
    this.end();
  }

  private end(): void {
    this.running?.abort();
    this.running = undefined;
  }

  private next(): void {
    if (this.running || !this.waiting) return;
    const { request } = this.waiting;
    const controller = (this.running = new AbortController());
    this.waiting = undefined;
    void this.run(request, controller.signal).finally(() => {
      if (this.running !== controller) return;
      this.running = undefined;
      this.next();
    });
  }
}
