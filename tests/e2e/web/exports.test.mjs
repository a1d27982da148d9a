// Files of `liquidblend export` for other programs, read by those: the Khronos validator, three.js,
// tinyusdz, Blender. Each frame is compared with the PLY file of the same export.
//   BLENDER: the program (default blender); where there is none, its test is skipped.
//   PICTURES: a folder that keeps the pictures.
import assert from 'node:assert/strict';
import { execFileSync, spawnSync } from 'node:child_process';
import { mkdtempSync, readFileSync, readdirSync, rmSync, writeFileSync } from 'node:fs';
import { createServer } from 'node:http';
import { tmpdir } from 'node:os';
import { extname, join } from 'node:path';
import { after, before, test } from 'node:test';
import { fileURLToPath } from 'node:url';
import { validateBytes } from 'gltf-validator';
import { USDAParser } from 'three/examples/jsm/loaders/usd/USDAParser.js';
import { family, newPage, report } from './page.mjs';

const fps = 3;
const folder = mkdtempSync(join(tmpdir(), 'liquidblend-exports-'));
const here = (path) => fileURLToPath(new URL(path, import.meta.url));
const roots = {
  page: here('exports'),
  out: folder,
  three: here('node_modules/three'),
  tinyusdz: here('node_modules/tinyusdz'),
  vat: here('../../../client/examples/vat'),
};
const types = { '.html': 'text/html', '.js': 'text/javascript', '.wasm': 'application/wasm' };

const vectors = ['--normals', '--velocities'];
const all = [...vectors, '--rest-positions'];

function exportAs(name, format, flags = all) {
  const program = process.env.LIQUIDBLEND_CLI ?? 'liquidblend';
  execFileSync(program, ['-q', 'export', family, '-w', '0:0/3:1', '--fps', `${fps}`, '--lod', '1',
    '--format', format, '-o', join(folder, name), ...flags]);
}

/** Positions, velocities, rest positions and indices of a PLY file that liquidblend wrote. */
function readPly(path) {
  const bytes = readFileSync(path);
  const end = bytes.indexOf('end_header\n') + 'end_header\n'.length;
  const head = bytes.subarray(0, end).toString();
  const count = (element) => Number(new RegExp(`element ${element} (\\d+)`).exec(head)[1]);
  const floats = head.match(/property float/g).length;
  const take = (first, size = 3) => {
    const values = new Float32Array(size * count('vertex'));
    for (let i = 0; i < values.length; ++i) {
      values[i] = bytes.readFloatLE(end + 4 * (floats * Math.floor(i / size) + first + (i % size)));
    }
    return values;
  };
  const faces = end + 4 * floats * count('vertex');
  const indices = new Uint32Array(3 * count('face'));
  for (let i = 0; i < indices.length; ++i) {
    indices[i] = bytes.readUInt32LE(faces + 13 * Math.floor(i / 3) + 1 + 4 * (i % 3));
  }
  return { positions: take(0), velocities: take(6), rest: take(9, 4), indices };
}

const decode = (Type, text) => new Type(new Uint8Array(Buffer.from(text, 'base64')).buffer);

function assertNear(actual, expected, tolerance, what) {
  assert.equal(actual.length, expected.length, what);
  let worst = 0;
  for (let i = 0; i < actual.length; ++i) worst = Math.max(worst, Math.abs(actual[i] - expected[i]));
  assert.ok(worst <= tolerance, `${what}: off by ${worst}`);
}

/** Compares two pictures: how far their pixels are apart on the average, and which share by much. */
function difference(a, b) {
  const [one, other] = [a, b].map((picture) => decode(Uint8Array, picture.pixels));
  let sum = 0;
  let many = 0;
  for (let i = 0; i < one.length; ++i) {
    const apart = Math.abs(one[i] - other[i]);
    sum += apart;
    many += apart > 16;
  }
  return { mean: sum / one.length, share: many / one.length };
}

function assertAlike(picture, expected, what) {
  keep(what, picture);
  const apart = difference(picture, expected);
  assert.ok(apart.mean < 0.1 && apart.share < 0.002, `${what}: ${JSON.stringify(apart)}`);
  return apart.mean;
}

function keep(name, picture) {
  if (!process.env.PICTURES) return;
  writeFileSync(join(process.env.PICTURES, `${name.replaceAll(' ', '_')}.png`),
    Buffer.from(picture.png, 'base64'));
}

const server = createServer((request, response) => {
  const [, root, path] = /^\/(\w+)\/(.*)$/.exec(request.url) ?? [];
  try {
    const bytes = readFileSync(join(roots[root], path));
    response.setHeader('Content-Type', types[extname(path)] ?? 'application/octet-stream');
    response.end(bytes);
  } catch {
    response.writeHead(404).end();
  }
});

let frames; // of the PLY export
let times; // in the middle of each
let page;

before(async () => {
  exportAs('ply', 'ply');
  exportAs('gltf', 'gltf');
  exportAs('draco', 'gltf', [...all, '--compression', 'draco']);
  exportAs('stl', 'stl', []);
  exportAs('usda', 'usda');
  exportAs('vat', 'vat', vectors);
  frames = readdirSync(join(folder, 'ply')).filter((name) => name.endsWith('.ply')).sort()
    .map((name) => readPly(join(folder, 'ply', name)));
  times = frames.map((_, i) => (i + 0.5) / fps);
  await new Promise((resolve) => server.listen(0, '127.0.0.1', resolve));
  page = await newPage();
  await page.goto(`http://127.0.0.1:${server.address().port}/page/page.html`);
  await page.waitForFunction(() => globalThis.exports);
});

after(async () => {
  await page?.context().close();
  server.close();
  rmSync(folder, { recursive: true, force: true });
});

const drawPly = (number) =>
  page.evaluate((url) => exports.drawPly(url), `/out/ply/frame_${`${number}`.padStart(4, '0')}.ply`);

for (const kind of ['gltf', 'draco']) {
  test(`TheValidatorFindsNothingWrong (${kind})`, async () => {
    const bytes = new Uint8Array(readFileSync(join(folder, kind, 'animation.glb')));
    const { issues } = await validateBytes(bytes, { maxIssues: 1000 });
    report(kind, { bytes: bytes.length, infos: issues.numInfos });
    assert.deepEqual([issues.numErrors, issues.numWarnings], [0, 0], JSON.stringify(issues.messages[0]));
  });

  test(`ThreeShowsEachFrameInItsTime (${kind})`, async () => {
    const played = await page.evaluate(([url, at]) => exports.playGltf(url, at),
      [`/out/${kind}/animation.glb`, times]);
    assert.ok(Math.abs(played.duration - frames.length / fps) < 1e-5, `${played.duration} s`);
    for (const [i, frame] of frames.entries()) {
      const shown = played.frames[i];
      assert.equal(shown.names.length, 1, `at ${times[i]} s: ${shown.names}`);
      // A decoder in JavaScript may round otherwise.
      const tolerance = kind === 'gltf' ? 0 : 1e-6;
      assertNear(decode(Float32Array, shown.position), frame.positions, tolerance, `positions ${i}`);
      assertNear(decode(Float32Array, shown.velocity), frame.velocities, 100 * tolerance, `velocities ${i}`);
      assertNear(decode(Float32Array, shown.rest), frame.rest, tolerance, `rest positions ${i}`);
      assert.deepEqual(decode(Uint32Array, shown.indices), frame.indices);
    }
    const middle = Math.floor(frames.length / 2);
    assertAlike(played.frames[middle].picture, await drawPly(middle + 1), `${kind} ${middle}`);
  });
}

test('StlHasTheCornersOfThePlyTriangles', async () => {
  const number = frames.length;
  const { positions, indices } = frames[number - 1];
  const corners = await page.evaluate((url) => exports.readStl(url),
    `/out/stl/frame_${`${number}`.padStart(4, '0')}.stl`);
  const expected = Float32Array.from({ length: 3 * indices.length },
    (_, i) => positions[3 * indices[Math.floor(i / 3)] + (i % 3)]);
  assertNear(decode(Float32Array, corners), expected, 0, 'corners');
});

test('TheShaderOfTheTexturesDrawsTheMeshes', async () => {
  // At frames: between two of them the shader moves vertices along their velocities.
  const pictures = await page.evaluate(([url, at]) => exports.playVat(url, at),
    ['/out/vat/vat.json', frames.map((_, i) => i / fps)]);
  const means = [];
  for (const i of [0, Math.floor(frames.length / 2), frames.length - 1]) {
    const mesh = await drawPly(i + 1);
    keep(`ply ${i}`, mesh);
    means.push(assertAlike(pictures[i], mesh, `vat ${i}`));
  }
  const moved = difference(pictures[0], pictures[frames.length - 1]);
  assert.ok(moved.mean > 1, `the first and the last picture are apart by ${moved.mean} only`);
  report('vat', { means, moved: moved.mean });
});

test('AnotherParserHasTheSameUsdFramesAndDrawsTheFirst', async () => {
  const text = readFileSync(join(folder, 'usda', 'animation.usda'), 'utf8');
  const { specsByPath } = new USDAParser().parseData(text);
  const samplesOf = (name) => specsByPath[`/liquid/surface.${name}`].fields.timeSamples;
  assert.deepEqual(samplesOf('points').times, frames.map((_, i) => i));
  for (const [i, frame] of frames.entries()) {
    assertNear(samplesOf('points').values[i].map(Math.fround), frame.positions, 0, `points ${i}`);
    assertNear(samplesOf('velocities').values[i].map(Math.fround), frame.velocities, 0, `velocities ${i}`);
    assertNear(samplesOf('primvars:rest').values[i].map(Math.fround), frame.rest, 0, `rest positions ${i}`);
    assert.deepEqual(Uint32Array.from(samplesOf('faceVertexIndices').values[i]), frame.indices);
    assert.ok(samplesOf('faceVertexCounts').values[i].every((count) => count === 3));
  }
  const picture = await page.evaluate((url) => exports.drawUsd(url), '/out/usda/animation.usda');
  assertAlike(picture, await drawPly(1), 'usda 0');
});

test('AReaderOfTheWholeUsdGrammarTakesTheFile', async () => {
  const read = await page.evaluate((url) => exports.readUsd(url), '/out/usda/animation.usda');
  assert.equal(read.error, undefined);
  assert.equal(read.num, 1);
  assertNear(decode(Float32Array, read.points), frames[0].positions, 0, 'points');
  assert.deepEqual(decode(Uint32Array, read.indices), frames[0].indices);
});

const blender = process.env.BLENDER ?? 'blender';
const hasBlender = spawnSync(blender, ['--version']).status === 0;

test('BlenderShowsTheFramesOfTheGltf', { skip: !hasBlender && 'Blender is not installed' }, () => {
  const out = execFileSync(blender, ['--background', '--factory-startup', '--python-exit-code', '1',
    '--python', here('exports/blender.py'), '--', join(folder, 'gltf', 'animation.glb'), `${fps}`,
    `${frames.length}`], { encoding: 'utf8', stdio: ['ignore', 'pipe', 'pipe'], maxBuffer: 1 << 26 });
  const shown = JSON.parse(/^FRAMES (.*)$/m.exec(out)[1]);
  for (const [i, frame] of frames.entries()) {
    assert.deepEqual(shown[i].names, [`frame_${`${i + 1}`.padStart(4, '0')}`]);
    assertNear(shown[i].positions, frame.positions, 1e-5, `frame ${i}`);
    assert.equal(shown[i].num_triangles, frame.indices.length / 3);
  }
});
