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

interface Ordered {
  order: number;
  frame: EncodedFrame;
}

/** One stream at a time. Frames of a stream that was closed never come. */
export class Live {
  numReceived = 0;
  numOvertaken = 0; // not decoded, since a newer one came
  wanted: Wanted = { normals: true, velocities: false, restPositions: false, edges: false };
  private readonly stream: FrameStream;
  private epoch = 0;
  private numDecoding = 0;
  private next: Ordered | undefined;
  private family = '';

  constructor(
    private readonly pool: DecoderPool,
    private readonly nextOrder: () => number,
    private readonly events: LiveEvents,
  ) {
    this.stream = new FrameStream(
      {
        ...events,
        frame: (frame) => this.receive(frame),
        probe: () => getFamily(this.family),
      },
      pool.size + 1, // what is being decoded, and one frame ahead
    );
  }

  open(request: StreamRequest): void {
    this.begin();
    this.family = request.family ?? '';
    this.stream.open(request);
  }

  change(request: StreamRequest): void {
    this.stream.change(request);
  }

  close(): void {
    this.begin();
    this.stream.close();
  }

  private begin(): void {
    ++this.epoch;
    this.next = undefined;
  }

  // While all workers are busy, only the newest frame waits.
  private receive(frame: EncodedFrame): void {
    ++this.numReceived;
    const ordered = { order: this.nextOrder(), frame };
    if (this.numDecoding < this.pool.size) return void this.decode(ordered);
    if (this.next) this.forgetNext();
    this.next = ordered;
  }

  private forgetNext(): void {
    this.next = undefined;
    ++this.numOvertaken;
    this.stream.grant();
  }

  private async decode({ order, frame }: Ordered): Promise<void> {
    const { epoch } = this;
    const { info, data } = frame;
    const numBytes = data.length;
    ++this.numDecoding;
    try {
      const decoded = await this.pool.decode(data, this.wanted);
      if (epoch !== this.epoch) this.pool.release(decoded.buffers);
      else this.events.frame({ order, info, numBytes, ...decoded });
    } catch (error) {
      if (epoch === this.epoch) this.events.error(toApiError(error));
    }
    --this.numDecoding;
    if (epoch === this.epoch) this.stream.grant();
    this.decodeNext();
  }

  private decodeNext(): void {
    const { next } = this;
    this.next = undefined;
    if (next) void this.decode(next);
  }
}
