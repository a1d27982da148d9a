// Frames on their way to the picture.
import type { FrameBuffers } from './buffers.ts';
import type { Counts } from './decode_messages.ts';

/** What the server says about a frame. */
export interface FrameInfo {
  version: number;
  timeS: number;
  frameNumber?: number | undefined; // of an animation
  weights: number[];
  levelOfDetail: number;
  extrapolated: boolean;
  clamped: boolean;
  numDropped: number; // by the server, since the stream began
}

/** A frame as it came. */
export interface EncodedFrame {
  info: FrameInfo;
  data: Uint8Array<ArrayBuffer>;
}

/** A frame that can be shown. Its buffers go back to the pool by `DecoderPool.release`. */
export interface DecodedFrame {
  order: number; // frames are shown in this order or not at all
  info: FrameInfo;
  numBytes: number;
  counts: Counts;
  buffers: FrameBuffers;
  decodeMs: number;
}
