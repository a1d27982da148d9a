// Decodes DIR/*.drc as a browser would, with npm's draco3d (WebAssembly), and writes each as NAME.bin
// beside it: uint32 counts (points, triangles, 1 if there are normals, 1 if there are velocities),
// uint32 triangles x 3, then float32 points x 3 of positions, normals and velocities.
//   node decode.mjs DIR
import draco3d from 'draco3d';
import fs from 'node:fs';
import path from 'node:path';

const draco = await draco3d.createDecoderModule({});

function decodeMesh(decoder, bytes) {
  const buffer = new draco.DecoderBuffer();
  buffer.Init(new Int8Array(bytes), bytes.length);
  if (decoder.GetEncodedGeometryType(buffer) !== draco.TRIANGULAR_MESH) throw Error('no mesh');
  const mesh = new draco.Mesh();
  const status = decoder.DecodeBufferToMesh(buffer, mesh);
  if (!status.ok() || mesh.ptr === 0) throw Error(status.error_msg());
  draco.destroy(buffer);
  return mesh;
}

function triangles(decoder, mesh) {
  const indices = new Uint32Array(3 * mesh.num_faces());
  const face = new draco.DracoInt32Array();
  for (let f = 0; f < mesh.num_faces(); ++f) {
    decoder.GetFaceFromMesh(mesh, f, face);
    for (let k = 0; k < 3; ++k) indices[3 * f + k] = face.GetValue(k);
  }
  draco.destroy(face);
  return indices;
}

function values(decoder, mesh, id) {
  if (id < 0) return new Float32Array(0);
  const array = new draco.DracoFloat32Array();
  const attribute = decoder.GetAttribute(mesh, id);
  if (!decoder.GetAttributeFloatForAllPoints(mesh, attribute, array)) throw Error(`attribute ${id}`);
  if (array.size() !== 3 * mesh.num_points()) throw Error(`attribute ${id} is not of 3 numbers`);
  const floats = new Float32Array(array.size());
  for (let i = 0; i < floats.length; ++i) floats[i] = array.GetValue(i);
  draco.destroy(array);
  return floats;
}

function decodeFile(file) {
  const decoder = new draco.Decoder();
  const mesh = decodeMesh(decoder, fs.readFileSync(file));
  const position = decoder.GetAttributeId(mesh, draco.POSITION);
  const normal = decoder.GetAttributeId(mesh, draco.NORMAL);
  const velocity = decoder.GetAttributeIdByMetadataEntry(mesh, 'name', 'velocity');
  const counts = [mesh.num_points(), mesh.num_faces(), Number(normal >= 0), Number(velocity >= 0)];
  const parts = [new Uint32Array(counts), triangles(decoder, mesh)];
  for (const id of [position, normal, velocity]) parts.push(values(decoder, mesh, id));
  const bytes = parts.map((part) => Buffer.from(part.buffer, part.byteOffset, part.byteLength));
  fs.writeFileSync(file.replace(/drc$/, 'bin'), Buffer.concat(bytes));
  draco.destroy(mesh);
  draco.destroy(decoder);
}

const directory = process.argv[2];
for (const name of fs.readdirSync(directory).filter((name) => name.endsWith('.drc')).sort()) {
  try {
    decodeFile(path.join(directory, name));
  } catch (error) {
    console.error(`${name}: ${error.message}`);
    process.exitCode = 1;
  }
}
