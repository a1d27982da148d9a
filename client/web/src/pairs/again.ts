// A registration that the editor begins, from the request to the new version of the family.
import { catalog } from '../api/catalog.ts';
import { registerFamily, type Json } from '../api/changes.ts';
import { isAbort, toApiError, type ApiError } from '../api/errors.ts';
import { watchJob, type Job } from '../api/operations.ts';
import { getFamily } from '../api/resources.ts';
import type { Family } from '../generated/liquidblend/v1/liquidblend_pb.ts';
import type { Residual } from './correspondences.ts';

/** A registration, and what was before it. */
export interface Run {
  job: Job;
  before: ReadonlyMap<number, Residual>;  // by number, of the version before
  versionBefore: bigint;
}

export interface AgainEvents {
  changed(): void;
  /** A new version is published. */
  published(family: Family): void;
}

export class Again {
  run: Run | undefined;
  error: ApiError | undefined;
  private controller = new AbortController();

  constructor(private readonly events: AgainEvents) {}

  get busy(): boolean {
    return this.run?.job.state === 'running';
  }

  /** Forgets a former one. */
  reset(): void {
    this.controller.abort();
    this.run = this.error = undefined;
  }

  async begin(family: Family, request: Json, before: ReadonlyMap<number, Residual>): Promise<void> {
    if (this.busy) return;
    this.reset();
    const { signal } = (this.controller = new AbortController());
    try {
      const job = await registerFamily(request);
      this.run = { job, before, versionBefore: family.version };
      this.events.changed();
      await this.follow(this.run, signal);
      if (this.run.job.state === 'done')
        this.events.published(await getFamily(family.name, 0n, signal));
    } catch (error) {
      if (!isAbort(error)) this.error = toApiError(error);
    }
    if (!signal.aborted) this.events.changed();
    void catalog.refresh();
  }

  private async follow(run: Run, signal: AbortSignal): Promise<void> {
    for await (const job of watchJob(run.job.name, signal)) {
      this.run = { ...run, job };
      this.events.changed();
    }
  }
}
