// Single frames by GET: the newest request wins.
import { isAbort, toApiError, type ApiError } from '../api/errors.ts';
import type { DecoderPool } from './decoder_pool.ts';
import type { Wanted } from './decode_messages.ts';
import type { DecodedFrame } from './frame.ts';
import { fetchFrame, type FrameRequest } from './frame_request.ts';
import { NewestWins } from './newest_wins.ts';

export interface StillRequest extends FrameRequest {
  wanted: Wanted;
}

interface Ordered {
  order: number;
  request: StillRequest;
}

export interface StillEvents {
  frame(frame: DecodedFrame): void;
  error(error: ApiError): void;
}

/** Fetches and decodes one frame at a time; at most one more waits. */
export class Stills {
  private readonly queue = new NewestWins<Ordered>((ordered, signal) => this.run(ordered, signal));

  constructor(
    private readonly pool: DecoderPool,
    private readonly events: StillEvents,
  ) {}

  get numRunning(): number {
    return this.queue.numRunning;
  }

  get numWaiting(): number {
    return this.queue.numWaiting;
  }

  get mostWaiting(): number {
    return this.queue.mostWaiting;
  }

  /** One that runs is shown first. */
  request(order: number, request: StillRequest): void {
    this.queue.push({ order, request });
  }

  /** If a request waits, ends the one that runs. */
  hurry(): void {
    this.queue.hurry();
  }

  cancel(): void {
    this.queue.cancel();
  }

  private async run({ order, request }: Ordered, signal: AbortSignal): Promise<void> {
    try {
      const { info, data } = await fetchFrame(request, signal);
      const numBytes = data.length;
      const decoded = await this.pool.decode(data, request.wanted);
      if (signal.aborted) this.pool.release(decoded.buffers);
      else this.events.frame({ order, info, numBytes, ...decoded });
    } catch (error) {
      if (!signal.aborted && !isAbort(error)) this.events.error(toApiError(error));
    }
  }
}
