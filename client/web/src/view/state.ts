// All that the viewer shows, and how the URL says it. What is as usual is left out.
import { clamp, roundTo } from '../base/numbers.ts';
import type { Loop } from '../stream/clock.ts';
import type { Orbit } from '../scene/orbit.ts';
import type { Shading } from '../scene/stage.ts';

/** What stands beside the blend: the source, a target, or another version of the family. */
export type Beside = 'source' | `target.${number}` | `version.${number}`;

export interface PaneState {
  timeS: number;
  orbit: Orbit | undefined;  // undefined: all in view
}

export interface ViewState {
  name: string;  // families/{id} or animations/{id}; empty: nothing
  version: bigint;  // 0: the published one
  weights: number[];
  point: number[];  // in the family's parameter space, instead of weights; empty: weights
  extrapolate: boolean;  // a point outside of the hull
  playing: boolean;
  rate: number;
  loop: Loop;
  range: [number, number];
  framesPerSecond: number;  // 0: the family's own
  level: number | 'auto';
  shading: Shading;
  wireframe: boolean;
  pattern: boolean; // that stays on the liquid, of a family
  theme: 'light' | 'dark' | '';  // empty: the reader's
  beside: Beside[];
  oneCamera: boolean;
  oneTime: boolean;
  panes: PaneState[];  // the blend's, then one for each of `beside`; the first alone if they are one
}

export const weightLimits: [number, number] = [-1, 2];
export const rateLimits: [number, number] = [0.05, 8];
export const maxBeside = 3;
const weightDecimals = 6;
const timeDecimals = 4;

export function initialState(): ViewState {
  return {
    name: '',
    version: 0n,
    weights: [],
    point: [],
    extrapolate: false,
    playing: false,
    rate: 1,
    loop: 'whole',
    range: [0, 0],
    framesPerSecond: 60,
    level: 'auto',
    shading: 'liquid',
    wireframe: false,
    pattern: false,
    theme: '',
    beside: [],
    oneCamera: true,
    oneTime: true,
    panes: [{ timeS: 0, orbit: undefined }],
  };
}

export function paneOf(state: ViewState, index: number): PaneState {
  return state.panes[index] ?? { timeS: state.panes[0]?.timeS ?? 0, orbit: state.panes[0]?.orbit };
}

function formatOrbit({ azimuth, elevation, distance, target }: Orbit): string {
  return [azimuth, elevation, distance, ...target].join(',');
}

function numbersOf(text: string | null): number[] {
  return (text ?? '').split(',').filter(Boolean).map(Number).filter(Number.isFinite);
}

function parseOrbit(text: string | null): Orbit | undefined {
  const [azimuth, elevation, distance, x, y, z] = numbersOf(text);
  if (z === undefined || !(distance! > 0)) return undefined;
  return { azimuth: azimuth!, elevation: elevation!, distance: distance!, target: [x!, y!, z] };
}

function suffix(index: number): string {
  return index ? String(index + 1) : '';
}

/** Writes what differs from the initial state. */
export function toFields(state: ViewState): URLSearchParams {
  const usual = initialState();
  const fields = new URLSearchParams();
  const set = (name: string, value: string | number, isUsual: boolean) => {
    if (!isUsual) fields.set(name, String(value));
  };
  const [collection, id] = state.name.split('/');
  if (id) fields.set(collection === 'families' ? 'family' : 'animation', id);
  set('version', String(state.version), state.version === 0n);
  set('w', state.weights.join(','), state.weights.every((weight) => weight === 0));
  set('p', state.point.join(','), !state.point.length);
  set('beyond', 1, !state.extrapolate);
  set('play', 1, !state.playing);
  set('rate', state.rate, state.rate === usual.rate);
  set('loop', state.loop, state.loop === usual.loop);
  set('range', state.range.join(','), state.range[1] === 0);
  set('fps', state.framesPerSecond, state.framesPerSecond === usual.framesPerSecond);
  set('level', state.level, state.level === 'auto');
  set('shade', state.shading, state.shading === usual.shading);
  set('wire', 1, !state.wireframe);
  set('pattern', 1, !state.pattern);
  set('theme', state.theme, !state.theme);
  set('beside', state.beside.join(','), !state.beside.length);
  set('cameras', 'own', state.oneCamera);
  set('times', 'own', state.oneTime);
  state.panes.forEach((pane, index) => {
    set(`t${suffix(index)}`, pane.timeS, pane.timeS === 0);
    if (pane.orbit) fields.set(`cam${suffix(index)}`, formatOrbit(pane.orbit));
  });
  return fields;
}

const besidePattern = /^(source|target\.\d{1,3}|version\.\d{1,15})$/;

function parseBeside(text: string | null): Beside[] {
  const items = (text ?? '').split(',').filter((item) => besidePattern.test(item));
  return [...new Set(items)].slice(0, maxBeside) as Beside[];
}

function oneOf<T extends string>(text: string | null, values: readonly T[], usual: T): T {
  return values.includes(text as T) ? (text as T) : usual;
}

function inRange(text: string | null, [low, high]: [number, number], usual: number): number {
  const value = text === null || text === '' ? usual : Number(text);
  return Number.isFinite(value) ? clamp(value, low, high) : usual;
}

function nameOf(fields: URLSearchParams): string {
  const family = fields.get('family');
  if (family) return `families/${family}`;
  const animation = fields.get('animation');
  return animation ? `animations/${animation}` : '';
}

function parseLevel(text: string | null): number | 'auto' {
  return /^\d$/.test(text ?? '') ? Number(text) : 'auto';
}

function parsePanes(fields: URLSearchParams, count: number): PaneState[] {
  return Array.from({ length: count }, (_, index) => ({
    timeS: roundTo(inRange(fields.get(`t${suffix(index)}`), [0, 1e9], 0), timeDecimals),
    orbit: parseOrbit(fields.get(`cam${suffix(index)}`)),
  }));
}

/** Reads a state; what is missing or makes no sense is as usual. */
export function fromFields(fields: URLSearchParams): ViewState {
  const usual = initialState();
  const version = fields.get('version') ?? '';
  const [from = 0, to = 0] = numbersOf(fields.get('range'));
  const beside = parseBeside(fields.get('beside'));
  const oneCamera = fields.get('cameras') !== 'own';
  const oneTime = fields.get('times') !== 'own';
  return {
    name: nameOf(fields),
    version: /^\d{1,18}$/.test(version) ? BigInt(version) : 0n,
    weights: numbersOf(fields.get('w')).map((weight) =>
      roundTo(clamp(weight, ...weightLimits), weightDecimals),
    ),
    point: numbersOf(fields.get('p')),
    extrapolate: fields.get('beyond') === '1',
    playing: fields.get('play') === '1',
    rate: inRange(fields.get('rate'), rateLimits, usual.rate),
    loop: oneOf(fields.get('loop'), ['off', 'whole', 'range'], usual.loop),
    range: [from, to],
    framesPerSecond: inRange(fields.get('fps'), [0, 240], usual.framesPerSecond),
    level: parseLevel(fields.get('level')),
    shading: oneOf(fields.get('shade'), ['liquid', 'plain'], usual.shading),
    wireframe: fields.get('wire') === '1',
    pattern: fields.get('pattern') === '1',
    theme: oneOf(fields.get('theme'), ['light', 'dark', ''], ''),
    beside,
    oneCamera,
    oneTime,
    panes: parsePanes(fields, oneCamera && oneTime ? 1 : 1 + beside.length),
  };
}
