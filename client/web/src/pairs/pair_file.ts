// The file of correspondences that `liquidblend register --correspondences` reads and
// `liquidblend inspect --correspondences-json` writes.
import { numberText } from './number_text.ts';
import type { Kind, Pair, SpaceTime, Vector, WholePair } from './pairs.ts';

export type FilePair = Omit<WholePair, 'number'>;

const kinds: Record<string, Kind> = { point: 'POINT', trajectory: 'TRAJECTORY', space: 'SPACE' };

type Json = Record<string, unknown>;

function fail(where: string, what: string): never {
  throw new Error(`${where}: ${what}`);
}

function isObject(value: unknown): value is Json {
  return typeof value === 'object' && value !== null && !Array.isArray(value);
}

function checkKeys(value: unknown, where: string, keys: string[]): Json {
  if (!isObject(value)) return fail(where, 'is not an object {...}');
  const unknown = Object.keys(value).find((key) => !keys.includes(key));
  return unknown === undefined ? value : fail(where, `unknown key "${unknown}"`);
}

function readNumber(value: unknown, where: string): number {
  return typeof value === 'number' ? value : fail(where, 'is not a number');
}

function readPlace(entry: Json, key: 'source' | 'target', entryName: string): SpaceTime {
  const where = `${entryName}.${key}`;
  if (!(key in entry)) fail(where, 'is missing');
  const value = checkKeys(entry[key], where, ['position', 'time_s']);
  if (!('time_s' in value)) fail(`${where}.time_s`, 'is missing');
  const { position } = value;
  if (!Array.isArray(position) || position.length !== 3) {
    return fail(`${where}.position`, 'is not a list [x, y, z]');
  }
  const read = position.map((one, i) => readNumber(one, `${where}.position[${i}]`));
  return { position: read as Vector, timeS: readNumber(value.time_s, `${where}.time_s`) };
}

function readKind(entry: Json, where: string): Kind {
  const { kind = 'point' } = entry;
  const known = typeof kind === 'string' && Object.hasOwn(kinds, kind) ? kinds[kind] : undefined;
  return (
    known ?? fail(`${where}.kind`, `${JSON.stringify(kind)} is not point, trajectory or space`)
  );
}

function readPair(value: unknown, where: string): FilePair {
  const entry = checkKeys(value, where, ['kind', 'hard', 'source', 'target', 'length_s']);
  const kind = readKind(entry, where);
  const { hard = false, length_s: length = 0 } = entry;
  if (typeof hard !== 'boolean') return fail(`${where}.hard`, 'is not true or false');
  const source = readPlace(entry, 'source', where);
  const target = readPlace(entry, 'target', where);
  const lengthS = readNumber(length, `${where}.length_s`);
  return { kind, hard, source, target, lengthS, enabled: true, check: false };
}

/** JSON without its comments. */
export function withoutComments(text: string): string {
  const pattern = /"(?:\\.|[^"\\])*"|\/\/[^\n\r]*|\/\*[^]*?\*\//g;
  return text.replace(pattern, (part) => (part.startsWith('"') ? part : ' '));
}

/** One list per target. Errors: throws, the message names file, target, entry and field. */
export function parsePairs(text: string, file: string): FilePair[][] {
  let json: unknown;
  try {
    json = JSON.parse(withoutComments(text));
  } catch {
    return fail(file, 'is not JSON');
  }
  const { correspondences } = checkKeys(json, file, ['correspondences']);
  if (!Array.isArray(correspondences)) return fail(file, '"correspondences" is not a list');
  return correspondences.map((entries: unknown, target) => {
    const where = `${file}: correspondences[${target}]`;
    if (!Array.isArray(entries)) return fail(where, 'is not a list; there is one list per target');
    return entries.map((entry, index) => readPair(entry, `${where}[${index}]`));
  });
}

function placeText({ position, timeS }: SpaceTime): string {
  return `{"position":[${position.map(numberText).join(',')}],"time_s":${numberText(timeS)}}`;
}

type Written = Pick<Pair, 'kind' | 'hard' | 'lengthS'> & { source: SpaceTime; target: SpaceTime };

function pairText({ kind, hard, source, target, lengthS }: Written): string {
  const fields = [
    `"kind":"${kind.toLowerCase()}"`,
    `"hard":${hard}`,
    `"source":${placeText(source)}`,
    `"target":${placeText(target)}`,
    `"length_s":${numberText(lengthS)}`,
  ];
  return `{${fields.join(',')}}`;
}

/** The text as the command line writes it. */
export function formatPairs(lists: readonly (readonly Written[])[]): string {
  const texts = lists.map((pairs) => {
    const entries = pairs.map((pair) => `\n    ${pairText(pair)}`);
    return `\n  [${entries.join(',')}]`;
  });
  return `{"correspondences": [${texts.join(',')}]}\n`;
}
