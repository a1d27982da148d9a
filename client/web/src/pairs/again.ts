// A registration that the editor begins, from the request to the new version of the family.
import { catalog } from '../api/catalog.ts';
import { registerFamily, type Json } from '../api/changes.ts';
import { toApiError, type ApiError } from '../api/errors.ts';
import { followJob, type Job } from '../api/operations.ts';
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
  private starting = false;  // the request is on its way
  private controller = new AbortController();

  constructor(private readonly events: AgainEvents) {}

  get busy(): boolean {
    return this.starting || this.run?.job.state === 'running';
  }

  /** Forgets a former one. */
  reset(): void {
    this.controller.abort();
    this.run = this.error = undefined;
    this.starting = false;
  }

  async begin(family: Family, request: Json, before: ReadonlyMap<number, Residual>): Promise<void> {
    if (this.busy) return;
    this.reset();
    const { signal } = (this.controller = new AbortController());
    this.starting = true;
    this.events.changed();
    try {
      const job = await registerFamily(request);
      signal.throwIfAborted();
      this.starting = false;
      await this.follow({ job, before, versionBefore: family.version }, signal);
      if (this.run?.job.state === 'done')
        this.events.published(await getFamily(family.name, 0n, signal));
    } catch (error) {
      if (!signal.aborted) this.fail(toApiError(error));
    }
    if (!signal.aborted) this.events.changed();
    void catalog.refresh();
  }

  private async follow(run: Run, signal: AbortSignal): Promise<void> {
    this.run = run;
    this.events.changed();
    for await (const job of followJob(run.job, signal)) {
      this.run = { ...run, job };
      this.events.changed();
    }
  }

  // Stops following the registration, which may go on.
  private fail(error: ApiError): void {
    this.error = error;
    this.starting = false;
    if (this.busy) this.run = undefined;
  }
}
