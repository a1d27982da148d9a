// How far a registration leaves the pairs of a target from where they should be, kept up to date.
import { isAbort, toApiError, type ApiError } from '../api/errors.ts';
import type { Family } from '../generated/liquidblend/v1/liquidblend_pb.ts';
import { registeredResiduals, type Residual } from './correspondences.ts';
import { measurePairs } from './measure.ts';
import { isWhole, type PairList } from './pairs.ts';

const waitMs = 150;  // for more changes

export class Residuals {
  error: ApiError | undefined;
  private values: ReadonlyMap<number, Residual> = new Map();
  private controller = new AbortController();
  private timer: ReturnType<typeof setTimeout> | undefined;

  /** `changed` is told when there are others. */
  constructor(private readonly changed: () => void) {}

  /** By the numbers of pairs. */
  get all(): ReadonlyMap<number, Residual> {
    return this.values;
  }

  /** Measures soon; what was asked for before is forgotten. */
  update(family: Family, target: number, list: PairList): void {
    this.close();
    this.timer = setTimeout(() => void this.measure(family, target, list), waitMs);
  }

  /** Forgets all, as another target is shown. */
  clear(): void {
    this.close();
    this.values = new Map();
    this.error = undefined;
  }

  close(): void {
    this.controller.abort();
    clearTimeout(this.timer);
  }

  // Takes residuals of registered pairs from the report, and has the server measure the others.
  private async measure(family: Family, target: number, { pairs }: PairList): Promise<void> {
    const { signal } = (this.controller = new AbortController());
    const whole = pairs.filter(isWhole);
    const values = registeredResiduals(
      family,
      target,
      whole.filter(({ check }) => !check),
    );
    const others = whole.filter(({ number, enabled }) => enabled && !values.has(number));
    this.error = undefined;
    try {
      const measured = others.length ? await measurePairs(family, target, others, signal) : [];
      others.forEach(({ number }, i) => measured[i] && values.set(number, measured[i]));
    } catch (error) {
      if (!isAbort(error)) this.error = toApiError(error);
    }
    if (signal.aborted) return;
    this.values = values;
    this.changed();
  }
}
