// What the page and a decoding worker say to each other.
import type { FrameBuffers } from './buffers.ts';

/** What shading needs beside positions and triangles. */
export interface Wanted {
  normals: boolean;
  velocities: boolean;
  restPositions: boolean;
  edges: boolean;
}

export interface SetUp {
  kind: 'setUp';
  module: WebAssembly.Module;
}

export interface DecodeJob {
  kind: 'decode';
  id: number;
  data: Uint8Array<ArrayBuffer>;
  wanted: Wanted;
  buffers: FrameBuffers;
}

/** The parts of the buffers that are used. */
export interface Counts {
  vertices: number;
  triangles: number;
  edges: number;
  hasNormals: boolean;
  hasVelocities: boolean;
  hasRestPositions: boolean;
}

export interface Decoded {
  id: number;
  buffers: FrameBuffers;
  counts?: Counts;
  error?: string;
  decodeMs: number;
}
