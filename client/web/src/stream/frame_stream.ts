// A WebSocket that brings frames at a steady pace, and comes again when it is lost.
import { create, fromBinary, toBinary, type MessageInitShape } from '@bufbuild/protobuf';
import { ApiError } from '../api/errors.ts';
import { subprotocols, token } from '../api/token.ts';
import { measured } from '../base/work.ts';
import {
  StreamFramesRequestSchema,
  StreamFramesResponseSchema,
} from '../generated/liquidblend/v1/liquidblend_pb.ts';
import { BackOff } from './back_off.ts';
import type { EncodedFrame } from './frame.ts';

export type StreamRequest = Omit<MessageInitShape<typeof StreamFramesRequestSchema>, '$typeName'>;
export type StreamState = 'closed' | 'connecting' | 'open' | 'waiting';

export interface StreamEvents {
  frame(frame: EncodedFrame): void;
  /** The animation is over. */
  end(): void;
  /** It will not come again by itself. */
  error(error: ApiError): void;
  state(state: StreamState): void;
  /** Finds out why a connection was refused, which browsers do not tell. Rejects with it. */
  probe(): Promise<unknown>;
}

const closedNormally = 1000;
const goingAway = 1001; // the server stops

function streamUrl(): string {
  return `${location.protocol === 'https:' ? 'wss' : 'ws'}://${location.host}/v1/stream`;
}

function encode(request: StreamRequest): Uint8Array<ArrayBuffer> {
  const message = create(StreamFramesRequestSchema, request);
  return toBinary(StreamFramesRequestSchema, message) as Uint8Array<ArrayBuffer>;
}

/** A frame, and the time of the one that follows. */
interface Received {
  frame: EncodedFrame;
  nextTimeS: number;
}

function decode(buffer: ArrayBuffer): Received | undefined {
  const { frame, levelOfDetail, numDropped, nextTimeS } = fromBinary(
    StreamFramesResponseSchema,
    new Uint8Array(buffer),
  );
  if (!frame?.data.length) return undefined;
  const { weights, timeS, extrapolated, clamped } = frame;
  const info = {
    version: Number(frame.version),
    timeS,
    weights,
    levelOfDetail,
    extrapolated,
    clamped,
    numDropped: Number(numDropped),
  };
  const encoded = { info, data: frame.data as Uint8Array<ArrayBuffer> };
  return { frame: encoded, nextTimeS: nextTimeS ?? timeS };
}

/** One stream. `change` may be called at any time; the newest values win. */
export class FrameStream {
  private socket: WebSocket | undefined;
  private request: StreamRequest = {}; // all that was asked for, for the next connection
  private readonly backOff = new BackOff();
  private timer: ReturnType<typeof setTimeout> | undefined;
  private hasBroughtFrames = false; // this connection

  constructor(
    private readonly events: StreamEvents,
    private readonly credit: number,  // frames that the server may send ahead
  ) {}

  open(request: StreamRequest): void {
    this.close();
    this.request = request;
    this.backOff.reset();
    this.connect();
  }

  change(request: StreamRequest): void {
    this.request = { ...this.request, ...request };
    if (this.socket?.readyState === WebSocket.OPEN) this.socket.send(encode(request));
  }

  /** One more frame may come. */
  grant(): void {
    if (this.socket?.readyState === WebSocket.OPEN) this.socket.send(encode({ credit: 1 }));
  }

  close(): void {
    clearTimeout(this.timer);
    const { socket } = this;
    this.socket = undefined;
    socket?.close(closedNormally);
    this.events.state('closed');
  }

  private connect(): void {
    const socket = new WebSocket(streamUrl(), subprotocols(token.value));
    this.socket = socket;
    socket.binaryType = 'arraybuffer';
    this.events.state('connecting');
    this.hasBroughtFrames = false;
    let opened = false;
    socket.onopen = () => {
      opened = true;
      if (this.socket !== socket) return;
      socket.send(encode({ ...this.request, credit: this.credit }));
      this.events.state('open');
    };
    socket.onmessage = ({ data }) => {
      if (this.socket === socket) measured(() => this.receive(data as ArrayBuffer));
    };
    socket.onclose = (event) => {
      if (this.socket === socket) void this.onClose(event, opened);
    };
  }

  private receive(buffer: ArrayBuffer): void {
    const received = decode(buffer);
    if (!received) return;
    this.backOff.reset();
    this.hasBroughtFrames = true;
    this.request.timeS = received.nextTimeS;
    this.events.frame(received.frame);
  }

  private async onClose(event: CloseEvent, opened: boolean): Promise<void> {
    const socket = this.socket;
    if (event.code === closedNormally) {
      this.close();
      this.events.end();
      return;
    }
    // Behind a proxy there is another server, at once.
    if (event.code === goingAway && this.hasBroughtFrames) {
      this.connect();
      return;
    }
    const error = await this.whyClosed(event, opened);
    if (this.socket !== socket) return;
    if (error.isTemporary) this.tryLater();
    else {
      this.close();
      this.events.error(error);
    }
  }

  private async whyClosed(event: CloseEvent, opened: boolean): Promise<ApiError> {
    if (event.code >= 4000) return new ApiError(event.code - 4000, event.reason);
    const lost = new ApiError(0, event.reason || 'The stream was lost.');
    if (opened) return lost;
    return this.events.probe().then(
      () => lost,
      (error: unknown) => (error instanceof ApiError ? error : lost),
    );
  }

  private tryLater(): void {
    this.events.state('waiting');
    this.timer = setTimeout(() => this.connect(), this.backOff.next());
  }
}
