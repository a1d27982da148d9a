// The liquid's surface on the graphics card. Its buffers grow and are used again, since three.js
// does not free attributes that are replaced (mrdoob/three.js#26835).
import { BufferAttribute, BufferGeometry, DynamicDrawUsage } from 'three';
import { roomFor, type FrameBuffers } from '../stream/buffers.ts';
import type { Counts } from '../stream/decode_messages.ts';

type FloatName = 'position' | 'normal' | 'rest';

export class Surface {
  readonly triangles = new BufferGeometry();
  readonly lines = new BufferGeometry();
  numGrown = 0;
  private vertexRoom = 0;
  private triangleRoom = 0;
  private edgeRoom = 0;

  /** Copies what the frame uses; its buffers are free again. */
  update(buffers: FrameBuffers, counts: Counts): void {
    const { vertices, triangles, edges } = counts;
    this.grow(vertices, triangles, edges);
    this.writeFloats('position', buffers.positions, vertices);
    if (counts.hasNormals) this.writeFloats('normal', buffers.normals, vertices);
    if (counts.hasRestPositions) this.writeFloats('rest', buffers.restPositions, vertices);
    writePart(this.triangles.index!, buffers.triangles, 3 * triangles);
    this.triangles.setDrawRange(0, 3 * triangles);
    if (edges) writePart(this.lines.index!, buffers.edges, 2 * edges);
    this.lines.setDrawRange(0, 2 * edges);
  }

  /** Shows nothing until the next update. */
  clear(): void {
    this.triangles.setDrawRange(0, 0);
    this.lines.setDrawRange(0, 0);
  }

  dispose(): void {
    this.triangles.dispose();
    this.lines.dispose();
  }

  private writeFloats(name: FloatName, from: Float32Array, vertices: number): void {
    const attribute = this.triangles.getAttribute(name) as BufferAttribute;
    writePart(attribute, from, attribute.itemSize * vertices);
  }

  // New attributes only after the old ones were freed.
  private grow(vertices: number, triangles: number, edges: number): void {
    const fits =
      vertices <= this.vertexRoom && triangles <= this.triangleRoom && edges <= this.edgeRoom;
    if (fits) return;
    ++this.numGrown;
    this.dispose();
    this.vertexRoom = Math.max(this.vertexRoom, roomFor(vertices));
    this.triangleRoom = Math.max(this.triangleRoom, roomFor(triangles));
    this.edgeRoom = Math.max(this.edgeRoom, edges && roomFor(edges));
    const position = floats(this.vertexRoom);
    this.triangles.setAttribute('position', position);
    this.triangles.setAttribute('normal', floats(this.vertexRoom));
    this.triangles.setAttribute('rest', floats(this.vertexRoom, 4));
    this.triangles.setIndex(indices(3 * this.triangleRoom));
    this.lines.setAttribute('position', position);
    this.lines.setIndex(indices(2 * this.edgeRoom));
  }
}

function floats(vertices: number, perVertex = 3): BufferAttribute {
  const attribute = new BufferAttribute(new Float32Array(perVertex * vertices), perVertex);
  return attribute.setUsage(DynamicDrawUsage);
}

function indices(length: number): BufferAttribute {
  const attribute = new BufferAttribute(new Uint32Array(length), 1);
  return attribute.setUsage(DynamicDrawUsage);
}

function writePart(
  attribute: BufferAttribute,
  from: Float32Array | Uint32Array,
  length: number,
): void {
  attribute.array.set(from.subarray(0, length));
  attribute.clearUpdateRanges();
  attribute.addUpdateRange(0, length);
  attribute.needsUpdate = true;
}
