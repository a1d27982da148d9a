// Frames of a family while it plays: by the stream, decoded by the pool.
import { toApiError, type ApiError } from '../api/errors.ts';
import { getFamily } from '../api/resources.ts';
import type { DecoderPool } from './decoder_pool.ts';
import type { Wanted } from './decode_messages.ts';
import type { DecodedFrame, EncodedFrame } from './frame.ts';
import { FrameStream, type StreamRequest, type StreamState } from './frame_stream.ts';

export interface LiveEvents {
  frame(frame: DecodedFrame): void;
  end(): void;
  error(error: ApiError): void;
  state(state: StreamState): void;
}

/** One stream at a time. Frames of a stream that was closed never come. */
export class Live {
  numReceived = 0;
  wanted: Wanted = { normals: true, velocities: false, edges: false };
  private readonly stream: FrameStream;
  private epoch = 0;
  private family = '';

  constructor(
    private readonly pool: DecoderPool,
    private readonly nextOrder: () => number,
    private readonly events: LiveEvents,
  ) {
    this.stream = new FrameStream(
      {
        ...events,
        frame: (frame) => void this.decode(frame),
        probe: () => getFamily(this.family),
      },
      pool.size + 1,  // what is being decoded, and one frame ahead
    );
  }

  open(request: StreamRequest): void {
    ++this.epoch;
    this.family = request.family ?? '';
    this.stream.open(request);
  }

  change(request: StreamRequest): void {
    this.stream.change(request);
  }

  close(): void {
    ++this.epoch;
    this.stream.close();
  }

  private async decode({ info, data }: EncodedFrame): Promise<void> {
    const { epoch } = this;
    const order = this.nextOrder();
    const numBytes = data.length;
    ++this.numReceived;
    try {
      const decoded = await this.pool.decode(data, this.wanted);
      if (epoch !== this.epoch) this.pool.release(decoded.buffers);
      else this.events.frame({ order, info, numBytes, ...decoded });
    } catch (error) {
      if (epoch === this.epoch) this.events.error(toApiError(error));
    }
    if (epoch === this.epoch) this.stream.grant();
  }
}
