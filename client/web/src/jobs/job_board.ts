// The server's operations, followed while somebody looks.
import { catalog } from '../api/catalog.ts';
import { isAbort, toApiError, type ApiError } from '../api/errors.ts';
import { listJobs, watchJob, type Job } from '../api/operations.ts';
import { Observable } from '../base/observable.ts';

export interface BoardState {
  jobs: Job[];  // the newest first
  hasMore: boolean;
  loading: boolean;
  error?: ApiError | undefined;
}

// Browsers open six connections to a server; frames need the others.
const maxWatched = 2;
const pollMs = 3000;
const pauseMs = 1500;

/** Lists all operations and watches those that run. */
export class JobBoard extends Observable<BoardState> {
  private users = 0;
  private controller = new AbortController();
  private readonly watched = new Map<string, AbortController>();
  private timer: ReturnType<typeof setInterval> | undefined;
  private nextPageToken = '';
  private older: Job[] = [];  // of further pages
  private readsMore = false;

  constructor() {
    super({ jobs: [], hasMore: false, loading: false });
  }

  /** Follows until the function that is returned is called. */
  follow(): () => void {
    if (++this.users === 1) this.begin();
    return () => {
      if (--this.users === 0) this.end();
    };
  }

  /** An operation that this page began. */
  add(job: Job): void {
    this.put(job);
    this.watchRunning();
  }

  async refresh(): Promise<void> {
    this.controller.abort();
    const { signal } = (this.controller = new AbortController());
    this.patch({ loading: true });
    try {
      const { items, nextPageToken } = await listJobs('', signal);
      if (!this.older.length) this.nextPageToken = nextPageToken;
      this.takeList(items);
      this.patch({ loading: false, hasMore: !!this.nextPageToken, error: undefined });
    } catch (error) {
      if (!isAbort(error)) this.patch({ loading: false, error: toApiError(error) });
    }
  }

  async more(): Promise<void> {
    if (this.readsMore) return;
    this.readsMore = true;
    try {
      const { items, nextPageToken } = await listJobs(this.nextPageToken);
      this.nextPageToken = nextPageToken;
      this.older = [...this.older, ...items];
      this.patch({ jobs: [...this.value.jobs, ...items], hasMore: !!nextPageToken });
    } catch (error) {
      this.patch({ error: toApiError(error) });
    }
    this.readsMore = false;
  }

  forget(name: string): void {
    this.older = this.older.filter((job) => job.name !== name);
    this.patch({ jobs: this.value.jobs.filter((job) => job.name !== name) });
  }

  private begin(): void {
    void this.refresh();
    this.timer = setInterval(() => this.poll(), pollMs);
  }

  private end(): void {
    clearInterval(this.timer);
    this.controller.abort();
    for (const controller of this.watched.values()) controller.abort();
    this.watched.clear();
  }

  // Those that are not watched, and those of others.
  private poll(): void {
    if (!document.hidden && !this.value.loading) void this.refresh();
  }

  private takeList(items: Job[]): void {
    const before = new Map(this.value.jobs.map((job) => [job.name, job]));
    const newest = items.map((job) =>
      this.watched.has(job.name) ? (before.get(job.name) ?? job) : job,
    );
    const names = new Set(items.map((job) => job.name));
    const others = (jobs: Job[]) => jobs.filter((job) => !names.has(job.name));
    const added = others(this.value.jobs.filter((job) => this.watched.has(job.name)));
    for (const job of newest) this.notice(before.get(job.name), job);
    this.patch({ jobs: [...added, ...newest, ...others(this.older)] });
    this.watchRunning();
  }

  private put(job: Job): void {
    const { jobs } = this.value;
    const at = jobs.findIndex(({ name }) => name === job.name);
    this.notice(jobs[at], job);
    this.patch({ jobs: at < 0 ? [job, ...jobs] : jobs.map((old, i) => (i === at ? job : old)) });
  }

  private notice(before: Job | undefined, job: Job): void {
    if (before?.state === 'running' && job.state !== 'running') void catalog.refresh();
  }

  private watchRunning(): void {
    if (!this.users) return;
    const running = this.value.jobs.filter(({ state }) => state === 'running');
    const byNeed = [...running].sort((a, b) => Number(isQueued(a)) - Number(isQueued(b)));
    for (const job of byNeed) {
      if (this.watched.size >= maxWatched) return;
      if (!this.watched.has(job.name)) void this.watch(job.name);
    }
  }

  private async watch(name: string): Promise<void> {
    const controller = new AbortController();
    this.watched.set(name, controller);
    try {
      for await (const job of watchJob(name, controller.signal)) this.put(job);
    } catch {
      // Lost: the list says how it is, and it is watched again after that.
      await new Promise((resolve) => setTimeout(resolve, pauseMs));
    }
    if (this.watched.get(name) === controller) this.watched.delete(name);
    if (!controller.signal.aborted) void this.refresh();
  }

  private patch(change: Partial<BoardState>): void {
    this.set({ ...this.value, ...change });
  }
}

function isQueued(job: Job): boolean {
  return (job.progress?.stage ?? 'queued') === 'queued';
}

export const jobBoard = new JobBoard();
