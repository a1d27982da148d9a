// Plays `liquidblend export --format vat` in three.js: one draw call, and no work for each frame but
// a number. Materials of three.js keep their lights, shadows and textures; only where vertices are
// comes from the export's textures.
//
//   const liquid = await loadVat('out/vat.json');
//   scene.add(liquid.mesh);
//   renderer.setAnimationLoop((ms) => {
//     liquid.setTime((ms / 1000) % liquid.duration);
//     renderer.render(scene, camera);
//   });
import {
  Box3, BufferGeometry, FloatType, Group, HalfFloatType, InstancedBufferAttribute, Mesh,
  MeshDepthMaterial, MeshStandardMaterial, NearestFilter, RGBADepthPacking, Sphere, Vector3,
} from 'three';
import { EXRLoader } from 'three/addons/loaders/EXRLoader.js';

// Item i of frame f lies in column i % width of row f * rows_per_frame + i / width, counted from the
// top; EXRLoader turns images upside down.
const declarations = `
uniform int vatFrame;
uniform float vatAhead;
uniform ivec3 vatTriangleLayout, vatVertexLayout;  // width, height, rows of a frame
uniform highp sampler2D vatTriangles, vatPositions;
#ifdef VAT_NORMALS
uniform highp sampler2D vatNormals;
#endif
#ifdef VAT_VELOCITIES
uniform highp sampler2D vatVelocities;
#endif
ivec2 vatTexel(int item, ivec3 layout_) {
  int row = vatFrame * layout_.z + item / layout_.x;
  return ivec2(item % layout_.x, layout_.y - 1 - row);
}
// Triangles that the frame does not have refer to one vertex thrice: they have no area.
ivec2 vatVertex() {
  vec3 corners = texelFetch(vatTriangles, vatTexel(gl_VertexID / 3, vatTriangleLayout), 0).xyz;
  return vatTexel(int(corners[gl_VertexID % 3]), vatVertexLayout);
}
`;

const normal = `
#ifdef VAT_NORMALS
vec3 objectNormal = texelFetch(vatNormals, vatVertex(), 0).xyz;
#else
vec3 objectNormal = vec3(0.0, 0.0, 1.0);
#endif
`;

const position = `
vec3 transformed = texelFetch(vatPositions, vatVertex(), 0).xyz;
#ifdef VAT_VELOCITIES
transformed += vatAhead * texelFetch(vatVelocities, vatVertex(), 0).xyz;
#endif
`;

/** Makes a material of three.js take its vertices from the textures. */
function patch(material, uniforms, defines) {
  material.defines = { ...material.defines, ...defines };
  material.onBeforeCompile = (shader) => {
    Object.assign(shader.uniforms, uniforms);
    shader.vertexShader = shader.vertexShader
      .replace('#include <common>', `#include <common>\n${declarations}`)
      .replace('#include <beginnormal_vertex>', normal)
      .replace('#include <begin_vertex>', position);
  };
  return material;
}

async function loadTexture(url, type) {
  const texture = await new EXRLoader().setDataType(type).loadAsync(url);
  texture.minFilter = texture.magFilter = NearestFilter;
  return texture;
}

/** The rotation that turns the family's upward direction to y. */
function turnUp(object, up) {
  const half = Math.PI / 2;
  const angles = { x: [0, 0, half], '-x': [0, 0, -half], y: [0, 0, 0], '-y': [2 * half, 0, 0],
    z: [-half, 0, 0], '-z': [half, 0, 0] };
  object.rotation.set(...angles[up]);
}

/** A geometry without data: the shader knows its vertices by their numbers. */
function emptyGeometry({ max_triangles: count, bounds, textures }) {
  const geometry = new BufferGeometry();
  // One for all vertices, never read: without the attribute three.js shades flatly.
  const placeholder = new InstancedBufferAttribute(new Float32Array(3), 3);
  if (textures.normals) geometry.setAttribute('normal', placeholder);
  geometry.setDrawRange(0, 3 * count);
  const { min, max } = bounds ?? { min: [0, 0, 0], max: [0, 0, 0] };
  geometry.boundingBox = new Box3(new Vector3(...min), new Vector3(...max));
  geometry.boundingSphere = geometry.boundingBox.getBoundingSphere(new Sphere());
  return geometry;
}

/**
 * Loads an export.
 *   url       of vat.json; the textures lie beside it
 *   material  of three.js, with begin_vertex in its shader
 * Returns { mesh, duration, setTime(seconds), dispose() }; mesh is a Group with y up, metres.
 */
export async function loadVat(url, material = new MeshStandardMaterial({ color: 0x2666b3, roughness: 0.2 })) {
  const info = await (await fetch(url)).json();
  const of = (name, type) => {
    const { file } = info.textures[name] ?? {};
    return file && loadTexture(new URL(file, new URL(url, document.baseURI)).href, type);
  };
  const [triangles, positions, normals, velocities] = await Promise.all([
    of('triangles', FloatType), of('positions', FloatType),
    of('normals', HalfFloatType), of('velocities', HalfFloatType),
  ]);
  const layout = ({ width, height, rows_per_frame: rows }) => ({ value: [width, height, rows] });
  const uniforms = {
    vatFrame: { value: 0 },
    vatAhead: { value: 0 },
    vatTriangleLayout: layout(info.textures.triangles),
    vatVertexLayout: layout(info.textures.positions),
    vatTriangles: { value: triangles },
    vatPositions: { value: positions },
    vatNormals: { value: normals },
    vatVelocities: { value: velocities },
  };
  const defines = { ...(normals && { VAT_NORMALS: '' }), ...(velocities && { VAT_VELOCITIES: '' }) };
  const surface = new Mesh(emptyGeometry(info), patch(material, uniforms, defines));
  surface.customDepthMaterial =
    patch(new MeshDepthMaterial({ depthPacking: RGBADepthPacking }), uniforms, defines);
  const mesh = new Group().add(surface);
  turnUp(mesh, info.up);
  const setTime = (seconds) => {
    const time = Math.max(seconds * info.frames_per_second, 0);
    const frame = Math.min(Math.floor(time + 1e-4), info.num_frames - 1);
    uniforms.vatFrame.value = frame;
    // Between two frames the surface goes on along its velocities.
    uniforms.vatAhead.value = Math.min(Math.max(time - frame, 0), 1) / info.frames_per_second;
  };
  const dispose = () => {
    for (const texture of [triangles, positions, normals, velocities]) texture?.dispose();
    surface.geometry.dispose();
  };
  return { mesh, duration: info.num_frames / info.frames_per_second, setTime, dispose };
}
