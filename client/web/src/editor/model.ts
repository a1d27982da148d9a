// The editor's state. Elements show it and call its methods.
import { registerFamily } from '../api/changes.ts';
import { catalog } from '../api/catalog.ts';
import { isAbort, toApiError, type ApiError } from '../api/errors.ts';
import { watchJob, type Job } from '../api/operations.ts';
import { getFamily } from '../api/resources.ts';
import { clamp, roundTo } from '../base/numbers.ts';
import { Observable } from '../base/observable.ts';
import type { Family } from '../generated/liquidblend/v1/liquidblend_pb.ts';
import type { Orbit } from '../scene/orbit.ts';
import { loadSubject, type SubjectInfo } from '../view/subject.ts';
import {
  automaticPairs,
  ownPairs,
  registeredResiduals,
  type AutomaticPair,
  type Residual,
} from './correspondences.ts';
import { History } from './history.ts';
import { measurePairs } from './measure.ts';
import {
  addPlace,
  appendPairs,
  deletePair,
  emptyList,
  isWhole,
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
} from './pairs.ts';
import { PairFiles } from './pair_files.ts';
import { againRequest, dropsSome, type AgainOptions } from './registration.ts';
import { loadLists, saveLists, startList } from './store.ts';

/** What of the editor stands in the URL. */
export interface EditorPlace {
  family: string;  // families/{id}; empty: none
  target: number;  // from 0
  times: Record<Side, number>;
}

/** A registration that this editor began. */
export interface Again {
  job: Job;
  before: Map<number, Residual>;  // by number, of the version before
  versionBefore: bigint;
}

const measureAfterMs = 150;
const placeDecimals = 6;

export class EditorModel {
  /** Told when something changed that elements show. */
  readonly changes = new Observable(0);
  /** Told when a camera moved or a frame came: markers are somewhere else. */
  readonly moves = new Observable(0);
  family: Family | undefined;
  infos: Partial<Record<Side, SubjectInfo>> = {};
  target = 0;
  times: Record<Side, number> = { source: 0, target: 0 };
  orbits: Partial<Record<Side, Orbit>> = {};
  oneCamera = true;
  showsAutomatic = true;
  habit: Habit = { kind: 'POINT', hard: false, check: false };
  selected = 0;  // the number of a pair; 0: none
  selectedAutomatic = '';  // a key
  error: ApiError | undefined;
  measureError: ApiError | undefined;
  again: Again | undefined;
  againError: ApiError | undefined;
  findPairs = true;
  readonly files = new PairFiles();
  private history = new History<readonly PairList[]>([]);
  private residuals = new Map<number, Residual>();
  private loading = new AbortController();
  private measuring = new AbortController();
  private watching = new AbortController();
  private measureTimer: ReturnType<typeof setTimeout> | undefined;

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

  get automatic(): AutomaticPair[] {
    return this.family ? automaticPairs(this.family, this.target) : [];
  }

  get busy(): boolean {
    return this.again?.job.state === 'running';
  }

  /** Which side the next click belongs to; undefined: either. */
  get wantedSide(): Side | undefined {
    const open = openPair(this.list);
    if (!open) return undefined;
    return open.source ? otherSide('source') : 'source';
  }

  residualOf(number: number): Residual | undefined {
    return this.residuals.get(number);
  }

  /** Shows a family and one of its targets. */
  async open({ family, target, times }: EditorPlace): Promise<void> {
    const same = this.family?.name === family;
    if (same && target === this.target) return;
    this.loading.abort();
    const { signal } = (this.loading = new AbortController());
    this.infos = {};
    this.error = undefined;
    this.times = { ...times };
    this.target = target;
    this.selected = 0;
    if (!same) this.family = undefined;
    this.tell();
    try {
      if (family) await this.load(family, signal);
    } catch (error) {
      if (isAbort(error)) return;
      this.error = toApiError(error);
      this.tell();
    }
  }

  setTarget(target: number): void {
    if (this.family) void this.open({ family: this.family.name, target, times: { source: 0, target: 0 } });
  }

  frameS(side: Side): number {
    return 1 / (this.infos[side]?.timing.framesPerSecond || 24);
  }

  durationS(side: Side): number {
    return this.infos[side]?.timing.durationS ?? 0;
  }

  setTime(side: Side, timeS: number): void {
    const frame = Math.round(clamp(timeS, 0, this.durationS(side)) / this.frameS(side));
    const time = Math.min(this.durationS(side), frame * this.frameS(side));
    this.times = { ...this.times, [side]: time };
    this.tell();
  }

  setOrbit(side: Side, orbit: Orbit | undefined): void {
    for (const one of this.oneCamera ? (['source', 'target'] as const) : [side]) {
      if (orbit) this.orbits[one] = orbit;
      else delete this.orbits[one];
    }
    this.moved();
  }

  setOneCamera(oneCamera: boolean): void {
    this.oneCamera = oneCamera;
    const { source } = this.orbits;
    if (oneCamera && source) this.orbits.target = source;
    this.tell();
    this.moved();
  }

  fit(): void {
    this.orbits = {};
    this.moved();
  }

  setShowsAutomatic(shows: boolean): void {
    this.showsAutomatic = shows;
    this.tell();
  }

  setHabit(change: Partial<Habit>): void {
    this.habit = { ...this.habit, ...change };
    this.tell();
  }

  // ---- pairs

  /** A click: the place becomes part of a pair. */
  addPlace(side: Side, place: SpaceTime): void {
    const open = openPair(this.list);
    const number = open?.number ?? this.list.nextNumber;
    this.edit((list) => addPlace(list, side, rounded(place), this.habit));
    this.select(number);
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
    if (this.selected === number) this.select(0);
  }

  /** Ends a trajectory or a space at the source's time. */
  endAtCursor(number: number): void {
    const pair = pairOf(this.list, number);
    if (!pair?.source || pair.kind === 'POINT') return;
    this.patchPair(number, { lengthS: roundTo(Math.max(0, this.times.source - pair.source.timeS), 6) });
  }

  pin({ key, pair }: AutomaticPair): void {
    const number = this.list.nextNumber;
    this.edit((list) => {
      const pinned = appendPairs(list, [pair]);
      return list.dropped.includes(key) ? pinned : toggleDropped(pinned, key);
    });
    this.select(number);
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

  select(number: number): void {
    this.selected = number;
    this.selectedAutomatic = '';
    this.tell();
  }

  /** Selects a pair and shows both of its times. */
  goTo(number: number): void {
    const pair = pairOf(this.list, number);
    if (!pair) return;
    this.times = {
      source: pair.source?.timeS ?? this.times.source,
      target: pair.target?.timeS ?? this.times.target,
    };
    this.select(number);
  }

  goToAutomatic({ key, pair }: AutomaticPair): void {
    this.times = { source: pair.source.timeS, target: pair.target.timeS };
    this.selected = 0;
    this.selectedAutomatic = key;
    this.tell();
  }

  /** Selects the pair after (1) or before (-1) the one that is selected. */
  step(by: 1 | -1): void {
    const numbers = this.list.pairs.map(({ number }) => number);
    if (!numbers.length) return;
    const at = numbers.indexOf(this.selected);
    const next = at < 0 ? (by > 0 ? 0 : numbers.length - 1) : (at + by + numbers.length) % numbers.length;
    this.goTo(numbers[next]!);
  }

  /** Replaces the pairs of all targets by those of a file. Errors: throws, with the reason. */
  importFile(text: string, name: string, asChecks: boolean): void {
    this.push(this.files.read(text, name, asChecks, this.lists));
  }

  // ---- registration

  async registerAgain(options: AgainOptions): Promise<void> {
    const { family } = this;
    if (!family || this.busy) return;
    this.againError = undefined;
    try {
      const job = await registerFamily(againRequest(family, this.lists, options));
      this.again = { job, before: new Map(this.residuals), versionBefore: family.version };
      this.tell();
      await this.watch(job.name);
    } catch (error) {
      if (!isAbort(error)) this.againError = toApiError(error);
      this.tell();
    }
  }

  close(): void {
    this.loading.abort();
    this.measuring.abort();
    this.watching.abort();
    clearTimeout(this.measureTimer);
  }

  /** Markers are somewhere else. */
  moved(): void {
    this.moves.set(this.moves.value + 1);
  }

  tell(): void {
    this.changes.set(this.changes.value + 1);
  }

  private async load(name: string, signal: AbortSignal): Promise<void> {
    if (!this.family) this.takeFamily(await getFamily(name, 0n, signal));
    signal.throwIfAborted();
    const family = this.family!;
    this.target = clamp(this.target, 0, Math.max(0, family.targets.length - 1));
    const names = { source: family.source, target: family.targets[this.target] };
    if (!names.target) throw new Error('The family is not registered yet.');
    const [source, target] = await Promise.all(
      [names.source, names.target].map((one) => loadSubject(one, 0n, signal)),
    );
    signal.throwIfAborted();
    this.infos = { source: source!, target: target! };
    this.setTime('source', this.times.source);
    this.setTime('target', this.times.target);
    this.measureSoon();
  }

  // Begins with the family's pairs, or with those that were marked on this version before.
  private takeFamily(family: Family): void {
    this.family = family;
    const stored = loadLists(family.name);
    const isSame = stored?.version === String(family.version) && stored.lists.length === family.targets.length;
    const lists = family.targets.map((_, target) =>
      isSame ? stored.lists[target]! : startList(ownPairs(family, target), stored?.lists[target]),
    );
    this.history = new History<readonly PairList[]>(lists);
    this.files.forget();
    const reports = family.reports.flatMap(({ correspondences }) => correspondences);
    this.findPairs = !reports.length || reports.some(({ automatic }) => automatic);
    this.again = this.againError = undefined;
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
    this.tell();
    this.measureSoon();
  }

  private measureSoon(): void {
    this.measuring.abort();
    clearTimeout(this.measureTimer);
    this.measureTimer = setTimeout(() => void this.measure(), measureAfterMs);
  }

  // What the registration said of its own pairs, and what the server measures of all others.
  private async measure(): Promise<void> {
    const { family, target } = this;
    if (!family) return;
    const { signal } = (this.measuring = new AbortController());
    const whole = this.list.pairs.filter(isWhole);
    const residuals = registeredResiduals(family, target, whole.filter(({ check }) => !check));
    const others = whole.filter(({ number, enabled }) => enabled && !residuals.has(number));
    try {
      this.measureError = undefined;
      const measured = others.length ? await measurePairs(family, target, others, signal) : [];
      if (signal.aborted) return;
      others.forEach(({ number }, i) => measured[i] && residuals.set(number, measured[i]));
    } catch (error) {
      if (isAbort(error) || signal.aborted) return;
      this.measureError = toApiError(error);
    }
    this.residuals = residuals;
    this.tell();
  }

  private async watch(name: string): Promise<void> {
    this.watching.abort();
    const { signal } = (this.watching = new AbortController());
    for await (const job of watchJob(name, signal)) {
      this.again = { ...this.again!, job };
      this.tell();
    }
    if (this.again?.job.state === 'done') await this.takeResult(signal);
    void catalog.refresh();
  }

  // The pairs keep their numbers; those that were dropped are the user's now.
  private async takeResult(signal: AbortSignal): Promise<void> {
    const family = await getFamily(this.family!.name, 0n, signal);
    const dropped = dropsSome(this.lists);
    const lists = this.lists.map((list, target) =>
      dropped ? withSent(list, this.family!, target) : list,
    );
    this.family = family;
    if (dropped) this.findPairs = false;
    this.history.replace(lists);
    this.afterEdit();
  }
}

function withSent(list: PairList, family: Family, target: number): PairList {
  if (!list.dropped.length) return list;
  const kept = automaticPairs(family, target).filter(({ key }) => !list.dropped.includes(key));
  return { ...appendPairs(list, kept.map(({ pair }) => pair)), dropped: [] };
}

function rounded({ position, timeS }: SpaceTime): SpaceTime {
  const [x, y, z] = position.map((value) => roundTo(value, placeDecimals)) as SpaceTime['position'];
  return { position: [x, y, z], timeS };
}
