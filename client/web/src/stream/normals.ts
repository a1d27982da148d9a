// Normals of vertices and edges of a surface from its triangles.

/** Writes unit normals: means of the triangles around a vertex, larger ones counting more. */
export function writeNormals(
  positions: Float32Array,
  triangles: Uint32Array,
  numVertices: number,
  numTriangles: number,
  normals: Float32Array,
): void {
  normals.fill(0, 0, 3 * numVertices);
  for (let i = 0; i < 3 * numTriangles; i += 3) {
    addTriangle(
      positions,
      3 * triangles[i]!,
      3 * triangles[i + 1]!,
      3 * triangles[i + 2]!,
      normals,
    );
  }
  for (let i = 0; i < 3 * numVertices; i += 3) normalize(normals, i);
}

function addTriangle(
  p: Float32Array,
  a: number,
  b: number,
  c: number,
  normals: Float32Array,
): void {
  const ux = p[b]! - p[a]!;
  const uy = p[b + 1]! - p[a + 1]!;
  const uz = p[b + 2]! - p[a + 2]!;
  const vx = p[c]! - p[a]!;
  const vy = p[c + 1]! - p[a + 1]!;
  const vz = p[c + 2]! - p[a + 2]!;
  const nx = uy * vz - uz * vy;
  const ny = uz * vx - ux * vz;
  const nz = ux * vy - uy * vx;
  for (const corner of [a, b, c]) {
    normals[corner] = normals[corner]! + nx;
    normals[corner + 1] = normals[corner + 1]! + ny;
    normals[corner + 2] = normals[corner + 2]! + nz;
  }
}

function normalize(normals: Float32Array, i: number): void {
  const length = Math.hypot(normals[i]!, normals[i + 1]!, normals[i + 2]!) || 1;
  normals[i] = normals[i]! / length;
  normals[i + 1] = normals[i + 1]! / length;
  normals[i + 2] = normals[i + 2]! / length;
}

/** Writes each edge of a closed surface once, as pairs of vertices. Returns their number. */
export function writeEdges(
  triangles: Uint32Array,
  numTriangles: number,
  edges: Uint32Array,
): number {
  let length = 0;
  for (let i = 0; i < 3 * numTriangles; i += 3) {
    for (let corner = 0; corner < 3; ++corner) {
      const from = triangles[i + corner]!;
      const to = triangles[i + ((corner + 1) % 3)]!;
      if (from > to) continue; // the neighbour has it the other way round
      edges[length++] = from;
      edges[length++] = to;
    }
  }
  return length / 2;
}
