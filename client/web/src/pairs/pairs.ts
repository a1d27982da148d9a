// Pairs that a person marks, and what can be done with them. Nothing here is changed in place, so
// that each state can be kept for undo.

export type Kind = 'POINT' | 'TRAJECTORY' | 'SPACE';
export type Side = 'source' | 'target';
export type Vector = [number, number, number];

/** A place in an animation, in its own coordinates. */
export interface SpaceTime {
  position: Vector;
  timeS: number;
}

export interface Pair {
  number: number;  // from 1; never that of another pair again
  kind: Kind;
  hard: boolean;
  lengthS: number;  // of trajectories and spaces; 0: to the end
  enabled: boolean;
  check: boolean;  // measured only, never sent to a registration
  source?: SpaceTime | undefined;
  target?: SpaceTime | undefined;
}

/** A pair with both of its places. */
export type WholePair = Pair & { source: SpaceTime; target: SpaceTime };

/** The pairs of one target. */
export interface PairList {
  pairs: readonly Pair[];
  nextNumber: number;
  dropped: readonly string[];  // automatic pairs that are not wanted, by their keys
}

export interface Habit {
  kind: Kind;
  hard: boolean;
  check: boolean;
}

export const emptyList: PairList = { pairs: [], nextNumber: 1, dropped: [] };

export function isWhole(pair: Pair): pair is WholePair {
  return !!pair.source && !!pair.target;
}

export function otherSide(side: Side): Side {
  return side === 'source' ? 'target' : 'source';
}

export function pairOf(list: PairList, number: number): Pair | undefined {
  return list.pairs.find((pair) => pair.number === number);
}

/** The pair that waits for its other place. */
export function openPair(list: PairList): Pair | undefined {
  return list.pairs.find((pair) => !isWhole(pair));
}

export function patchPair(list: PairList, number: number, change: Partial<Pair>): PairList {
  const pairs = list.pairs.map((pair) => (pair.number === number ? { ...pair, ...change } : pair));
  return { ...list, pairs };
}

function append(list: PairList, pair: Omit<Pair, 'number'>): PairList {
  const added = { ...pair, number: list.nextNumber };
  return { ...list, pairs: [...list.pairs, added], nextNumber: list.nextNumber + 1 };
}

/** Adds a place: the other one of the pair that waits for it, or the first one of a new pair. */
export function addPlace(list: PairList, side: Side, place: SpaceTime, habit: Habit): PairList {
  const open = openPair(list);
  if (open) return patchPair(list, open.number, { [side]: place });
  return append(list, { ...habit, lengthS: 0, enabled: true, [side]: place });
}

export function movePlace(list: PairList, number: number, side: Side, place: SpaceTime): PairList {
  return patchPair(list, number, { [side]: place });
}

/** The numbers of the others stay. */
export function deletePair(list: PairList, number: number): PairList {
  return { ...list, pairs: list.pairs.filter((pair) => pair.number !== number) };
}

export function appendPairs(list: PairList, pairs: readonly Omit<Pair, 'number'>[]): PairList {
  return pairs.reduce(append, list);
}

export function toggleDropped(list: PairList, key: string): PairList {
  const has = list.dropped.includes(key);
  const dropped = has ? list.dropped.filter((one) => one !== key) : [...list.dropped, key];
  return { ...list, dropped };
}

/** What goes to a registration and into files. */
export function sentPairs(list: PairList): WholePair[] {
  return list.pairs.filter(isWhole).filter((pair) => pair.enabled && !pair.check);
}

export function checkPairs(list: PairList): WholePair[] {
  return list.pairs.filter(isWhole).filter((pair) => pair.enabled && pair.check);
}

export function distanceBetween(a: Vector, b: Vector): number {
  return Math.hypot(a[0] - b[0], a[1] - b[1], a[2] - b[2]);
}

/** How long after the end, or before the begin, of a place's time another one is; 0 within. */
export function timeDistance(pair: Pair, place: SpaceTime, timeS: number): number {
  if (pair.kind === 'POINT') return Math.abs(timeS - place.timeS);
  const end = pair.lengthS ? place.timeS + pair.lengthS : Number.POSITIVE_INFINITY;
  return Math.max(0, place.timeS - timeS, timeS - end);
}
