// What is used of draco3d's decoder. Its main file would bring the encoder, too.
declare module 'draco3d/draco_decoder_nodejs.js' {
  export interface Mesh {
    num_points(): number;
    num_faces(): number;
  }
  export interface Attribute {
    num_components(): number;
  }
  export interface Status {
    ok(): boolean;
    error_msg(): string;
  }
  export interface Decoder {
    DecodeArrayToMesh(data: Uint8Array, size: number, mesh: Mesh): Status;
    GetAttributeId(mesh: Mesh, type: number): number;
    GetAttributeIdByMetadataEntry(mesh: Mesh, name: string, value: string): number;
    GetAttribute(mesh: Mesh, id: number): Attribute;
    GetTrianglesUInt32Array(mesh: Mesh, bytes: number, at: number): boolean;
    GetAttributeDataArrayForAllPoints(
      mesh: Mesh,
      attribute: Attribute,
      type: number,
      bytes: number,
      at: number,
    ): boolean;
  }
  export interface DecoderModule {
    Decoder: new () => Decoder;
    Mesh: new () => Mesh;
    POSITION: number;
    NORMAL: number;
    DT_FLOAT32: number;
    HEAPF32: Float32Array<ArrayBuffer>;
    HEAPU32: Uint32Array<ArrayBuffer>;
    _malloc(bytes: number): number;
    _free(at: number): void;
    destroy(object: object): void;
  }
  const createDecoderModule: (options: Record<string, unknown>) => Promise<DecoderModule>;
  export default createDecoderModule;
}
