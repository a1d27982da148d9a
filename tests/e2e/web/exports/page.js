// What exports.test.mjs calls in the browser: globalThis.exports.
import {
  AmbientLight, AnimationMixer, Color, DirectionalLight, Group, Mesh, MeshStandardMaterial, PerspectiveCamera,
  Scene, WebGLRenderer,
} from 'three';
import { DRACOLoader } from 'three/addons/loaders/DRACOLoader.js';
import { GLTFLoader } from 'three/addons/loaders/GLTFLoader.js';
import { PLYLoader } from 'three/addons/loaders/PLYLoader.js';
import { STLLoader } from 'three/addons/loaders/STLLoader.js';
import { USDLoader } from 'three/addons/loaders/USDLoader.js';
import { loadVat } from '/vat/vat.js';

const size = 384;
const renderer = new WebGLRenderer({ preserveDrawingBuffer: true });
renderer.setSize(size, size);
const makeMaterial = () => new MeshStandardMaterial({ color: 0x2666b3, roughness: 0.4 });

/** The picture of an object as base64 of a PNG, and its pixels as base64. */
function draw(object) {
  const scene = new Scene().add(object, new AmbientLight(0xffffff, 0.6));
  const sun = new DirectionalLight(0xffffff, 2.5);
  sun.position.set(1, 2, 1.5);
  scene.add(sun);
  scene.background = new Color(0xdde3ea);
  const camera = new PerspectiveCamera(35, 1, 0.1, 100);
  camera.position.set(3, 3, 7);
  camera.lookAt(0, 0, 0);
  renderer.render(scene, camera);
  const gl = renderer.getContext();
  const pixels = new Uint8Array(4 * size * size);
  gl.readPixels(0, 0, size, size, gl.RGBA, gl.UNSIGNED_BYTE, pixels);
  return { pixels: encode(pixels), png: renderer.domElement.toDataURL().split(',')[1] };
}

function encode(array) {
  let text = '';
  const bytes = new Uint8Array(array.buffer, array.byteOffset, array.byteLength);
  for (let i = 0; i < bytes.length; i += 8192) text += String.fromCharCode(...bytes.subarray(i, i + 8192));
  return btoa(text);
}

const turned = (object) => {
  const group = new Group().add(object);
  group.rotation.x = -Math.PI / 2;
  return group;
};

const drawPly = async (url) =>
  draw(turned(new Mesh(await new PLYLoader().loadAsync(url), makeMaterial())));

/** The meshes that a glTF animation shows at some times: their arrays, and a picture of each. */
async function playGltf(url, times) {
  const draco = new DRACOLoader().setDecoderPath('/three/examples/jsm/libs/draco/gltf/');
  const gltf = await new GLTFLoader().setDRACOLoader(draco).loadAsync(url);
  const mixer = new AnimationMixer(gltf.scene);
  mixer.clipAction(gltf.animations[0]).play();
  const frames = times.map((time) => {
    mixer.setTime(time);
    gltf.scene.updateMatrixWorld(true);
    const shown = [];
    gltf.scene.traverse((node) => {
      if (node.isMesh && node.matrixWorld.determinant() > 0.5) shown.push(node);
    });
    const array = (name) => {
      const attribute = shown[0].geometry.getAttribute(name);
      return attribute && encode(new Float32Array(attribute.array));
    };
    for (const mesh of shown) mesh.material = makeMaterial();
    return {
      names: shown.map((mesh) => mesh.name),
      position: array('position'),
      velocity: array('_velocity'),
      rest: array('_rest'),
      indices: encode(new Uint32Array(shown[0].geometry.index.array)),
      picture: draw(gltf.scene),
    };
  });
  draco.dispose();
  return { duration: gltf.animations[0].duration, frames };
}

async function playVat(url, times) {
  const liquid = await loadVat(url, makeMaterial());
  return times.map((time) => {
    liquid.setTime(time);
    return draw(liquid.mesh);
  });
}

/** The first frame of a USD file. */
async function drawUsd(url) {
  const scene = await new USDLoader().loadAsync(url);
  scene.traverse((node) => {
    if (node.isMesh) node.material = makeMaterial();
  });
  return draw(scene);
}

/** What another reader, of the whole grammar, has of a USD file's first frame. */
async function readUsd(url) {
  const { default: init } = await import('/tinyusdz/tinyusdz.js');
  const module = await init();
  const loader = new module.TinyUSDZLoaderNative();
  const bytes = new Uint8Array(await (await fetch(url)).arrayBuffer());
  if (!loader.loadFromBinary(bytes, 'animation.usda')) return { error: loader.error?.() ?? 'refused' };
  const { points, faceVertexIndices } = loader.getMesh(0);
  return { num: loader.numMeshes(), points: encode(points), indices: encode(faceVertexIndices) };
}

/** Corners of an STL file's triangles. */
const readStl = async (url) =>
  encode((await new STLLoader().loadAsync(url)).getAttribute('position').array);

globalThis.exports = { drawPly, drawUsd, playGltf, playVat, readStl, readUsd };
