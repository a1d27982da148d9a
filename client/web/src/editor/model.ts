// The editor's state. Elements show it and call its methods.
import { isAbort, toApiError, type ApiError } from '../api/errors.ts';
import { getFamily } from '../api/resources.ts';
import { clamp } from '../base/numbers.ts';
import { Observable } from '../base/observable.ts';
import type { Family } from '../generated/liquidblend/v1/liquidblend_pb.ts';
import { Again } from '../pairs/again.ts';
import { automaticPairs, type AutomaticPair } from '../pairs/correspondences.ts';
import { PairDocument } from '../pairs/document.ts';
import { pairOf, type Habit, type PairList, type Side, type SpaceTime } from '../pairs/pairs.ts';
import { againRequest, dropsSome, type AgainOptions } from '../pairs/registration.ts';
import { Residuals } from '../pairs/residuals.ts';
import type { Orbit } from '../scene/orbit.ts';
import { loadSubject, type SubjectInfo } from '../view/subject.ts';

/** What of the editor stands in the URL. */
export interface EditorPlace {
  family: string;  // families/{id}; empty: none
  target: number;  // from 0
  times: Record<Side, number>;
}

interface Found {
  family: Family | undefined;
  target: number;
  pairs: readonly AutomaticPair[];
}

const sides: readonly Side[] = ['source', 'target'];

export class EditorModel {
  /** Told when something changed that elements show. */
  readonly changes = new Observable(0);
  /** Told when a camera moved: markers are somewhere else. */
  readonly moves = new Observable(0);
  readonly pairs = new PairDocument(() => this.onEdit());
  readonly residuals = new Residuals(() => this.tell());
  readonly again = new Again({
    changed: () => this.tell(),
    published: (family) => this.takeVersion(family),
  });
  family: Family | undefined;
  infos: Partial<Record<Side, SubjectInfo>> = {};
  times: Record<Side, number> = { source: 0, target: 0 };
  orbits: Partial<Record<Side, Orbit>> = {};
  oneCamera = true;
  showsAutomatic = true;
  findsPairs = true;  // so does the next registration
  habit: Habit = { kind: 'POINT', hard: false, check: false };
  selected = 0;  // the number of a pair; 0: none
  selectedAutomatic = '';  // a key
  error: ApiError | undefined;
  private loading = new AbortController();
  private found: Found | undefined;

  get target(): number {
    return this.pairs.target;
  }

  get list(): PairList {
    return this.pairs.list;
  }

  /** What the registration found for this target. */
  get automatic(): readonly AutomaticPair[] {
    const { family, target } = this;
    if (this.found?.family !== family || this.found?.target !== target) {
      this.found = { family, target, pairs: family ? automaticPairs(family, target) : [] };
    }
    return this.found!.pairs;
  }

  /** Shows a family and one of its targets. */
  async open({ family, target, times }: EditorPlace): Promise<void> {
    const same = this.family?.name === family;
    if (same && target === this.target && this.infos.source) return this.setTimes(times);
    this.residuals.clear();
    if (!same) this.again.reset();
    this.loading.abort();
    const { signal } = (this.loading = new AbortController());
    this.infos = {};
    this.error = undefined;
    this.times = { ...times };
    this.pairs.target = target;
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
    if (!this.family) return;
    void this.open({ family: this.family.name, target, times: { source: 0, target: 0 } });
  }

  /** Changes what has no rule of its own. */
  set(change: Partial<Pick<EditorModel, 'showsAutomatic' | 'findsPairs'>>): void {
    Object.assign(this, change);
    this.tell();
  }

  setHabit(change: Partial<Habit>): void {
    this.habit = { ...this.habit, ...change };
    this.tell();
  }

  // ---- times and cameras

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

  private setTimes(times: Record<Side, number>): void {
    for (const side of sides) this.setTime(side, times[side]);
  }

  setOrbit(side: Side, orbit: Orbit): void {
    for (const one of this.oneCamera ? sides : [side]) this.orbits[one] = orbit;
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

  // ---- pairs

  /** A place that was clicked becomes part of a pair. */
  addPlace(side: Side, place: SpaceTime): void {
    this.select(this.pairs.addPlace(side, place, this.habit));
  }

  deletePair(number: number): void {
    this.pairs.deletePair(number);
    if (this.selected === number) this.select(0);
  }

  pin(found: AutomaticPair): void {
    this.select(this.pairs.pin(found));
  }

  select(number: number): void {
    this.selected = number;
    this.selectedAutomatic = '';
    this.tell();
  }

  selectAutomatic(key: string): void {
    this.selected = 0;
    this.selectedAutomatic = key;
    this.tell();
  }

  /** Selects a pair and shows both of its times. */
  goTo(number: number): void {
    const pair = pairOf(this.list, number);
    if (!pair) return;
    const { source, target } = this.times;
    this.times = { source: pair.source?.timeS ?? source, target: pair.target?.timeS ?? target };
    this.select(number);
  }

  goToAutomatic({ key, pair }: AutomaticPair): void {
    this.times = { source: pair.source.timeS, target: pair.target.timeS };
    this.selectAutomatic(key);
  }

  /** Selects the pair after (1) or before (-1) the one that is selected. */
  step(by: 1 | -1): void {
    const numbers = this.list.pairs.map(({ number }) => number);
    if (!numbers.length) return;
    const at = numbers.indexOf(this.selected);
    const first = by > 0 ? 0 : numbers.length - 1;
    this.goTo(numbers[at < 0 ? first : (at + by + numbers.length) % numbers.length]!);
  }

  async registerAgain(options: AgainOptions): Promise<void> {
    const { family } = this;
    if (!family) return;
    const request = againRequest(family, this.pairs.lists, options);
    await this.again.begin(family, request, this.residuals.all);
  }

  close(): void {
    this.loading.abort();
    this.residuals.close();
    this.again.reset();
  }

  tell(): void {
    this.changes.set(this.changes.value + 1);
  }

  private moved(): void {
    this.moves.set(this.moves.value + 1);
  }

  private async load(name: string, signal: AbortSignal): Promise<void> {
    const family = this.family ?? (await getFamily(name, 0n, signal));
    signal.throwIfAborted();
    if (!this.family) this.takeFamily(family);
    this.pairs.target = clamp(this.target, 0, Math.max(0, family.targets.length - 1));
    const target = family.targets[this.target];
    if (!target || !family.version) throw new Error('The family is not registered yet.');
    const names = [family.source, target];
    const infos = await Promise.all(names.map((one) => loadSubject(one, 0n, signal)));
    signal.throwIfAborted();
    this.infos = { source: infos[0]!, target: infos[1]! };
    this.setTimes(this.times);
    this.measure();
  }

  private takeFamily(family: Family): void {
    this.family = family;
    this.pairs.begin(family);
    this.again.reset();
    const reports = family.reports.flatMap(({ correspondences }) => correspondences);
    this.findsPairs = !reports.length || reports.some(({ automatic }) => automatic);
  }

  private takeVersion(family: Family): void {
    if (dropsSome(this.pairs.lists)) this.findsPairs = false;
    this.family = family;
    this.pairs.registered(family);
  }

  private onEdit(): void {
    this.tell();
    this.measure();
  }

  private measure(): void {
    if (this.family) this.residuals.update(this.family, this.target, this.list);
  }
}
