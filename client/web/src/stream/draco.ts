// Reads Draco meshes by draco3d's WASM.
import createDecoderModule, {
  type Attribute,
  type Decoder,
  type DecoderModule,
  type Mesh,
} from 'draco3d/draco_decoder_nodejs.js';
import { grownFloats, grownIndices, type FrameBuffers } from './buffers.ts';
import type { Counts, Wanted } from './decode_messages.ts';
import { writeEdges, writeNormals } from './normals.ts';

const velocityName = 'velocity';
const restName = 'rest';

export async function createDraco(module: WebAssembly.Module): Promise<DracoReader> {
  const instantiateWasm = (
    imports: WebAssembly.Imports,
    done: (i: WebAssembly.Instance) => void,
  ) => {
    void WebAssembly.instantiate(module, imports).then(done);
    return {};
  };
  return new DracoReader(await createDecoderModule({ instantiateWasm }));
}

/** Reads one mesh after the other into buffers, which grow if they have to. */
export class DracoReader {
  private scratch = 0;
  private scratchBytes = 0;

  constructor(private readonly draco: DecoderModule) {}

  /** Errors: throws for data that is no mesh. */
  read(data: Uint8Array, wanted: Wanted, buffers: FrameBuffers): Counts {
    const decoder = new this.draco.Decoder(); // not reusable: google/draco#656
    const mesh = new this.draco.Mesh();
    try {
      const status = decoder.DecodeArrayToMesh(data, data.length, mesh);
      if (!status.ok()) throw new Error(status.error_msg());
      return this.copy(decoder, mesh, wanted, buffers);
    } finally {
      this.draco.destroy(mesh);
      this.draco.destroy(decoder);
    }
  }

  private copy(decoder: Decoder, mesh: Mesh, wanted: Wanted, buffers: FrameBuffers): Counts {
    const vertices = mesh.num_points();
    const triangles = mesh.num_faces();
    this.copyTriangles(decoder, mesh, buffers);
    const { POSITION } = this.draco;
    const position = decoder.GetAttribute(mesh, decoder.GetAttributeId(mesh, POSITION));
    buffers.positions = this.copyFloats(decoder, mesh, position, buffers.positions);
    const hasNormals = wanted.normals && this.fillNormals(decoder, mesh, buffers);
    const velocities = wanted.velocities && this.named(decoder, mesh, velocityName);
    if (velocities)
      buffers.velocities = this.copyFloats(decoder, mesh, velocities, buffers.velocities);
    const rest = wanted.restPositions && this.named(decoder, mesh, restName);
    if (rest)
      buffers.restPositions = this.copyFloats(decoder, mesh, rest, buffers.restPositions, 4);
    const edges = wanted.edges ? fillEdges(triangles, buffers) : 0;
    const has = { hasNormals, hasVelocities: !!velocities, hasRestPositions: !!rest };
    return { vertices, triangles, edges, ...has };
  }

  private copyTriangles(decoder: Decoder, mesh: Mesh, buffers: FrameBuffers): void {
    const length = 3 * mesh.num_faces();
    const at = this.reserve(4 * length);
    decoder.GetTrianglesUInt32Array(mesh, 4 * length, at);
    buffers.triangles = grownIndices(buffers.triangles, length);
    buffers.triangles.set(new Uint32Array(this.draco.HEAPU32.buffer, at, length));
  }

  private copyFloats(
    decoder: Decoder,
    mesh: Mesh,
    attribute: Attribute,
    into: Float32Array<ArrayBuffer>,
    perVertex = 3,
  ): Float32Array<ArrayBuffer> {
    const length = perVertex * mesh.num_points();
    const at = this.reserve(4 * length);
    const { DT_FLOAT32 } = this.draco;
    decoder.GetAttributeDataArrayForAllPoints(mesh, attribute, DT_FLOAT32, 4 * length, at);
    const grown = grownFloats(into, length);
    grown.set(new Float32Array(this.draco.HEAPF32.buffer, at, length));
    return grown;
  }

  private fillNormals(decoder: Decoder, mesh: Mesh, buffers: FrameBuffers): boolean {
    const id = decoder.GetAttributeId(mesh, this.draco.NORMAL);
    if (id >= 0) {
      const attribute = decoder.GetAttribute(mesh, id);
      buffers.normals = this.copyFloats(decoder, mesh, attribute, buffers.normals);
      return true;
    }
    const vertices = mesh.num_points();
    buffers.normals = grownFloats(buffers.normals, 3 * vertices);
    const { positions, triangles, normals } = buffers;
    writeNormals(positions, triangles, vertices, mesh.num_faces(), normals);
    return true;
  }

  private named(decoder: Decoder, mesh: Mesh, name: string): Attribute | undefined {
    const id = decoder.GetAttributeIdByMetadataEntry(mesh, 'name', name);
    return id < 0 ? undefined : decoder.GetAttribute(mesh, id);
  }

  // Memory of the decoder for its answers; it only grows.
  private reserve(bytes: number): number {
    if (bytes > this.scratchBytes) {
      if (this.scratch) this.draco._free(this.scratch);
      this.scratchBytes = Math.ceil(bytes * 1.5);
      this.scratch = this.draco._malloc(this.scratchBytes);
    }
    return this.scratch;
  }
}

function fillEdges(numTriangles: number, buffers: FrameBuffers): number {
  buffers.edges = grownIndices(buffers.edges, 3 * numTriangles);
  return writeEdges(buffers.triangles, numTriangles, buffers.edges);
}
