// Arrays of decoded frames. They travel between the page and its workers, and are used again.

/** What a frame's arrays have room for; a frame may use less. */
export interface FrameBuffers {
  positions: Float32Array<ArrayBuffer>;
  normals: Float32Array<ArrayBuffer>;
  velocities: Float32Array<ArrayBuffer>;
  restPositions: Float32Array<ArrayBuffer>; // four a vertex: place in the source, and its time
  triangles: Uint32Array<ArrayBuffer>;
  edges: Uint32Array<ArrayBuffer>;
}

export function emptyBuffers(): FrameBuffers {
  return {
    positions: new Float32Array(0),
    normals: new Float32Array(0),
    velocities: new Float32Array(0),
    restPositions: new Float32Array(0),
    triangles: new Uint32Array(0),
    edges: new Uint32Array(0),
  };
}

/** The number of elements to make room for, so that growing stays rare. */
export function roomFor(length: number): number {
  return Math.ceil(length * 1.25);
}

/** An array with room for `length` elements: the given one, or a larger one. */
export function grownFloats(array: Float32Array<ArrayBuffer>, length: number) {
  return array.length >= length ? array : new Float32Array(roomFor(length));
}

export function grownIndices(array: Uint32Array<ArrayBuffer>, length: number) {
  return array.length >= length ? array : new Uint32Array(roomFor(length));
}

export function transferables(buffers: FrameBuffers): ArrayBuffer[] {
  return Object.values(buffers).map((array: Float32Array<ArrayBuffer>) => array.buffer);
}

/** Buffers that no frame uses at the moment. */
export class BufferPool {
  private readonly idle: FrameBuffers[] = [];
  private made = 0;

  /** Keeps at most `limit` sets. */
  constructor(private readonly limit = 8) {}

  get numMade(): number {
    return this.made;
  }

  take(): FrameBuffers {
    const buffers = this.idle.pop();
    if (buffers) return buffers;
    ++this.made;
    return emptyBuffers();
  }

  give(buffers: FrameBuffers): void {
    if (this.idle.length < this.limit) this.idle.push(buffers);
  }
}
