// The pairs of all targets of a family, with undo; kept in the browser until they are registered.
import { roundTo } from '../base/numbers.ts';
import type { Family } from '../generated/liquidblend/v1/liquidblend_pb.ts';
import { automaticPairs, ownPairs, type AutomaticPair } from './correspondences.ts';
import { History } from './history.ts';
import { PairFiles } from './pair_files.ts';
import {
  addPlace,
  appendPairs,
  deletePair,
  emptyList,
  movePlace,
  openPair,
  otherSide,
  pairOf,
  patchPair,
  toggleDropped,
  type Habit,
  type Pair,
  type PairList,
  type Side,
  type SpaceTime,
  type WholePair,
} from './pairs.ts';
import { dropsSome, keptPairs } from './registration.ts';
import { loadLists, saveLists, startList } from './store.ts';

const placeDecimals = 6;

function rounded({ position, timeS }: SpaceTime): SpaceTime {
  const [x, y, z] = position.map((value) => roundTo(value, placeDecimals)) as SpaceTime['position'];
  return { position: [x, y, z], timeS };
}

// Adds pairs with the numbers after those of another state of the list.
function withSent(list: PairList, sent: readonly Omit<WholePair, 'number'>[], next: number) {
  return { ...appendPairs({ ...list, nextNumber: next }, sent), dropped: [] };
}

// Without automatic pairs that another version had.
function withoutStrangers(list: PairList, family: Family, target: number): PairList {
  const known = new Set(automaticPairs(family, target).map(({ key }) => key));
  return { ...list, dropped: list.dropped.filter((key) => known.has(key)) };
}

export class PairDocument {
  /** The target whose pairs are marked. */
  target = 0;
  private history = new History<readonly PairList[]>([]);
  private readonly files = new PairFiles();
  private family: Family | undefined;

  /** `changed` is told of each edit. */
  constructor(private readonly changed: () => void) {}

  get lists(): readonly PairList[] {
    return this.history.value;
  }

  get list(): PairList {
    return this.lists[this.target] ?? emptyList;
  }

  get canUndo(): boolean {
    return this.history.canUndo;
  }

  get canRedo(): boolean {
    return this.history.canRedo;
  }

  /** Which side the next place belongs to; undefined: either. */
  get wantedSide(): Side | undefined {
    const open = openPair(this.list);
    if (!open) return undefined;
    return open.source ? otherSide('source') : 'source';
  }

  /** Begins with the pairs that were marked before and the family's. */
  begin(family: Family): void {
    this.family = family;
    const stored = loadLists(family.name);
    const isSame = stored?.version === String(family.version);
    const lists = family.targets.map((_, target) => {
      const list = stored?.lists[target];
      if (isSame && list) return list;
      return withoutStrangers(startList(ownPairs(family, target), list), family, target);
    });
    this.history = new History<readonly PairList[]>(lists);
    this.files.forget();
  }

  /** The family has a version with these pairs now, which keep their numbers. */
  registered(family: Family): void {
    const before = this.family;
    this.family = family;
    if (before && dropsSome(this.lists)) this.keepSent(before);
    this.afterEdit();
  }

  // Where automatic pairs were dropped, the others were sent as the user's and are so now, in all
  // states: there are no automatic ones to go back to.
  private keepSent(before: Family): void {
    const sent = this.lists.map((list, target) => keptPairs(before, target, list));
    const next = this.lists.map(({ nextNumber }) => nextNumber);
    this.history.map((lists) =>
      lists.map((list, target) => withSent(list, sent[target]!, next[target]!)),
    );
  }

  /** Returns the number of the pair that the place belongs to now. */
  addPlace(side: Side, place: SpaceTime, habit: Habit): number {
    const number = openPair(this.list)?.number ?? this.list.nextNumber;
    this.edit((list) => addPlace(list, side, rounded(place), habit));
    return number;
  }

  movePlace(number: number, side: Side, place: SpaceTime): void {
    this.edit((list) => movePlace(list, number, side, rounded(place)));
  }

  patchPair(number: number, change: Partial<Omit<Pair, 'number'>>): void {
    this.edit((list) => patchPair(list, number, change));
  }

  toggleEnabled(number: number): void {
    const pair = pairOf(this.list, number);
    if (pair) this.patchPair(number, { enabled: !pair.enabled });
  }

  deletePair(number: number): void {
    this.edit((list) => deletePair(list, number));
  }

  /** Ends a trajectory or a space at a time of the source. */
  endAt(number: number, timeS: number): void {
    const pair = pairOf(this.list, number);
    if (!pair?.source || pair.kind === 'POINT') return;
    this.patchPair(number, { lengthS: roundTo(Math.max(0, timeS - pair.source.timeS), 6) });
  }

  /** Copies an automatic pair into the user's, in place of it. Returns its number. */
  pin({ key, pair }: AutomaticPair): number {
    const number = this.list.nextNumber;
    this.edit((list) => {
      const pinned = appendPairs(list, [pair]);
      return list.dropped.includes(key) ? pinned : toggleDropped(pinned, key);
    });
    return number;
  }

  toggleDropped(key: string): void {
    this.edit((list) => toggleDropped(list, key));
  }

  undo(): void {
    this.history.undo();
    this.afterEdit();
  }

  redo(): void {
    this.history.redo();
    this.afterEdit();
  }

  /** Replaces the pairs of all targets by those of a file. Errors: throws, with the reason. */
  importFile(text: string, name: string, asChecks: boolean): void {
    this.push(this.files.read(text, name, asChecks, this.lists));
  }

  /** The text of a file of the pairs that are sent, or of the check pairs. */
  exportFile(checks: boolean): string {
    return this.files.write(this.lists, checks);
  }

  private edit(change: (list: PairList) => PairList): void {
    this.push(this.lists.map((list, target) => (target === this.target ? change(list) : list)));
  }

  private push(lists: readonly PairList[]): void {
    this.history.push(lists);
    this.afterEdit();
  }

  private afterEdit(): void {
    if (this.family) saveLists(this.family.name, this.family.version, this.lists);
    this.changed();
  }
}
