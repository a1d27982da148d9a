// Animations and families that tests need: made by the API where they are not there yet.
import { execFileSync } from 'node:child_process';
import { readdirSync } from 'node:fs';
import { fileURLToPath } from 'node:url';
import { baseUrl, token } from './page.mjs';

const data = fileURLToPath(new URL('../../data/', import.meta.url));

export function folderOf(name) {
  return `${data}${name}`;
}

/** An answer of the server; its JSON unless it is something else. */
export async function api(path, { method = 'GET', body, type = 'application/json' } = {}) {
  const headers = token ? { Authorization: `Bearer ${token}` } : {};
  if (body !== undefined) headers['Content-Type'] = type;
  const json = body !== undefined && type === 'application/json';
  const response = await fetch(baseUrl + path, {
    method,
    headers,
    body: json ? JSON.stringify(body) : body,
  });
  const isJson = (response.headers.get('content-type') ?? '').includes('json');
  return { status: response.status, json: isJson ? await response.json() : undefined, response };
}

async function wait(operation) {
  for (;;) {
    const { json } = await api(`/v1/${operation.name}`);
    if (json.done && json.error) throw new Error(`${operation.name}: ${json.error.message}`);
    if (json.done) return;
    await new Promise((resolve) => setTimeout(resolve, 200));
  }
}

async function begin(path, options) {
  const { status, json } = await api(path, options);
  if (status !== 200) throw new Error(`${path}: ${JSON.stringify(json)}`);
  await wait(json);
}

/** Imports a folder of tests/data. */
export async function ensureAnimation(id, folder) {
  if ((await api(`/v1/animations/${id}`)).status === 200) return;
  const files = readdirSync(folderOf(folder));
  const body = execFileSync(
    'tar',
    ['--format=ustar', '-cf', '-', '-C', folderOf(folder), ...files],
    {
      maxBuffer: 1 << 28,
    },
  );
  const query = `header.animationId=${id}&header.numFiles=${files.length}`;
  await begin(`/v1/animations:upload?${query}`, {
    method: 'POST',
    body,
    type: 'application/x-tar',
  });
}

/** Registers a family. `request`: a RegisterFamilyRequest without its id. */
export async function ensureFamily(id, request) {
  const { json } = await api(`/v1/families/${id}`);
  if (!Number(json?.version ?? 0)) {
    await begin('/v1/families', { method: 'POST', body: { familyId: id, ...request } });
  }
  return id;
}

/** Publishes another version of a family. */
export async function refineFamily(id) {
  const body = { familyId: id, refine: true, options: { maxIterations: 1 } };
  await begin('/v1/families', { method: 'POST', body });
}

const clips = ['dam_break_clip/w0_p0', 'dam_break_clip/w1_p1'];

/** Four animations of 12 frames, e2e_clip_0 to 3. */
export async function ensureClips() {
  for (let i = 0; i < 4; ++i) await ensureAnimation(`e2e_clip_${i}`, clips[i % 2]);
  return [0, 1, 2, 3].map((i) => `animations/e2e_clip_${i}`);
}

/** A family of the four clips. `points`: the source's first, with a value for each name. */
async function ensureFamilyOfPoints(id, names, points, interpolation = 'LINEAR') {
  const [source, ...targets] = await ensureClips();
  return ensureFamily(id, {
    source,
    targets,
    options: { maxIterations: 2 },
    spaceTime: { coarserLevels: 0 },
    parameterSpace: { names, points: points.map((values) => ({ values })), interpolation },
  });
}

const quadrilateral = [
  [0.5, 20],
  [1, 20],
  [0.6, 60],
  [1.2, 55],
];

/** A family with four points of two parameters, two triangles. */
export function ensurePadFamily() {
  return ensureFamilyOfPoints('e2e_pad', ['wall_width', 'place'], quadrilateral);
}

/** The same points, interpolated smoothly. */
export function ensureSmoothFamily() {
  return ensureFamilyOfPoints('e2e_smooth', ['wall_width', 'place'], quadrilateral, 'SMOOTH');
}

/** A family with four points of three parameters, one tetrahedron. */
export function ensureTetrahedron() {
  return ensureFamilyOfPoints(
    'e2e_tetrahedron',
    ['width', 'place', 'height'],
    [
      [0.5, 20, 1],
      [1, 20, 1],
      [0.6, 60, 1],
      [0.7, 30, 3],
    ],
  );
}
