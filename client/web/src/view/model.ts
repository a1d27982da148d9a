// The viewer's state and what it does to the pictures. Elements show it and call its methods.
import { isAbort, toApiError, type ApiError } from '../api/errors.ts';
import { clamp, roundTo } from '../base/numbers.ts';
import { Observable } from '../base/observable.ts';
import { theme } from '../base/theme.ts';
import { ParameterSpace_Interpolation } from '../generated/liquidblend/v1/liquidblend_pb.ts';
import type { Orbit } from '../scene/orbit.ts';
import type { Look } from '../scene/stage.ts';
import { sharedPool } from '../stream/decoder_pool.ts';
import type { Loop } from '../stream/clock.ts';
import type { FrameInfo } from '../stream/frame.ts';
import type { Blend } from '../stream/frame_request.ts';
import type { PlayerSettings } from '../stream/player.ts';
import { actions } from './actions.ts';
import type { Action } from './keys.ts';
import { clear, newPane, resolve, titleOf, type Pane } from './panes.ts';
import { Picture } from './picture.ts';
import {
  initialState,
  paneOf,
  weightLimits,
  type Beside,
  type PaneState,
  type ViewState,
} from './state.ts';
import { loadSubject } from './subject.ts';

function isSmooth({ info }: Pane): boolean {
  const { interpolation } = info?.family?.parameterSpace ?? {};
  return interpolation === ParameterSpace_Interpolation.SMOOTH;
}

export class ViewModel {
  readonly pool = sharedPool();
  /** Told when something changed that elements show, but for times. */
  readonly changes = new Observable(0);
  /** Told of a pane whose time changed. */
  readonly times = new Observable<Pane | undefined>(undefined);
  /** Told when the state is another one, to be written into the URL. */
  readonly states = new Observable<ViewState>(initialState());
  panes: Pane[] = [];
  private loading: AbortController | undefined;

  get state(): ViewState {
    return this.states.value;
  }

  get main(): Pane | undefined {
    return this.panes[0];
  }

  get targets(): string[] {
    return this.main?.info?.family?.targets ?? [];
  }

  /** Shows a state, as of a URL. */
  async open(state: ViewState): Promise<void> {
    this.loading?.abort();
    this.loading = new AbortController();
    const { signal } = this.loading;
    const { name, version } = this.state;
    const same = name === state.name && version === state.version && !!this.main?.info;
    this.states.set(state);
    this.setPanes(same);
    try {
      const { main } = this;
      if (main && !main.info) await this.load(main, state.name, state.version, signal);
      await this.loadBeside(signal);
    } catch (error) {
      if (!isAbort(error) && this.main) this.setError(this.main, toApiError(error));
    }
  }

  /** A pane's element made its canvas. */
  attach(pane: Pane, canvas: HTMLCanvasElement): Picture {
    const picture = new Picture(canvas, this.pool, {
      shown: (frame) => this.onShown(pane, frame),
      changed: () => this.onPlayerChanged(pane),
      error: (error) => this.setError(pane, error),
    });
    pane.picture = picture;
    picture.setLook(this.look);
    this.start(pane);
    return picture;
  }

  patch(change: Partial<ViewState>): void {
    this.states.set({ ...this.state, ...change });
    this.applyLook();
    for (const pane of this.panes) pane.picture?.player?.configure(this.settings(pane));
    this.tell();
  }

  setWeight(index: number, value: number): void {
    const weights = this.targets.map((_, target) => this.state.weights[target] ?? 0);
    weights[index] = roundTo(clamp(value, ...weightLimits), 6);
    this.patch({ weights, point: [], extrapolate: false });
  }

  /** Asks for a point in parameter space; `weights` are what is known of its weights. */
  setPoint(point: number[], extrapolate: boolean, weights: number[]): void {
    this.patch({ point, extrapolate, weights: weights.map((weight) => roundTo(weight, 6)) });
  }

  setBeside(beside: Beside[]): void {
    const { oneCamera, oneTime } = this.state;
    const before = new Map(this.panes.map(({ key }, index) => [key, paneOf(this.state, index)]));
    const [main, ...others] = ['main' as const, ...beside].map(
      (key) => before.get(key) ?? paneOf(this.state, 0),
    );
    const panes = oneCamera && oneTime ? [main!] : [main!, ...others];
    void this.open({ ...this.state, beside, panes });
  }

  setOrbit(pane: Pane, orbit: Orbit | undefined): void {
    const shared = this.state.oneCamera;
    this.setPane(shared ? 0 : this.panes.indexOf(pane), { orbit });
    for (const other of shared ? this.panes : [pane]) other.picture?.setOrbit(orbit);
  }

  togglePlay(pane: Pane): void {
    const player = pane.picture?.player;
    if (!player) return;
    if (player.playing) player.pause();
    else player.play();
  }

  /** `last`: no other one follows at once. */
  seek(pane: Pane, timeS: number, last: boolean): void {
    pane.picture?.player?.seek(timeS, last);
    if (this.leads(pane)) this.follow(timeS, last);
  }

  fit(): void {
    for (const pane of this.state.oneCamera ? this.panes.slice(0, 1) : this.panes) {
      this.setOrbit(pane, undefined);
    }
  }

  setLoop(loop: Loop): void {
    const durationS = this.main?.info?.timing.durationS ?? 0;
    const [from, to] = this.state.range;
    this.patch({ loop, range: to > from ? [from, to] : [0, roundTo(durationS, 4)] });
  }

  /** Couples cameras or times, or lets them go their own ways from where they are. */
  setTogether(which: 'oneCamera' | 'oneTime'): void {
    const panes = this.panes.map((pane, index) => ({
      timeS: pane.picture?.player?.timeS ?? 0,
      orbit: paneOf(this.state, this.state.oneCamera ? 0 : index).orbit,
    }));
    void this.open({ ...this.state, panes, [which]: !this.state[which] });
  }

  /** What a key asks for. */
  act(action: Action): void {
    const { main } = this;
    if (main) actions[action]?.(this, main);
  }

  hold(pane: Pane): void {
    pane.picture?.player?.hold();
  }

  letGo(pane: Pane): void {
    pane.picture?.player?.letGo();
  }

  get look(): Look {
    const { shading, wireframe, pattern } = this.state;
    return { shading, wireframe, pattern, theme: theme.value };
  }

  settings(pane: Pane): PlayerSettings {
    const { rate, loop, range, framesPerSecond, level, wireframe, pattern } = this.state;
    const restPositions = pattern && !!pane.info?.family;
    const wanted = { normals: true, velocities: false, restPositions, edges: wireframe };
    return { blend: this.blend(pane), rate, loop, range, framesPerSecond, level, wanted };
  }

  /** One for each target of the pane's family. */
  weights(pane: Pane): number[] {
    const { weights } = this.state;
    return (pane.info?.family?.targets ?? []).map((_, target) => weights[target] ?? 0);
  }

  // Other versions may have their points elsewhere: they are asked for by weights.
  private blend(pane: Pane): Blend {
    const { point, extrapolate } = this.state;
    const names = pane.info?.family?.parameterSpace?.names ?? [];
    const isPoint = pane === this.main && names.length > 0 && point.length === names.length;
    if (!isPoint) return { weights: this.weights(pane) };
    const parameters = names.map((name, i) => ({ name, value: point[i]! }));
    return { weights: [], parameters, extrapolate };
  }

  close(): void {
    this.loading?.abort();
    for (const { picture } of this.panes) picture?.close();
    this.panes = [];
  }

  // Panes keep their canvas while what they show changes.
  private setPanes(same: boolean): void {
    const { name, beside } = this.state;
    const before = new Map(this.panes.map((pane) => [pane.key, pane]));
    const keys: Pane['key'][] = name ? ['main', ...beside] : [];
    this.panes = keys.map((key) => before.get(key) ?? newPane(key));
    for (const pane of before.values()) if (!this.panes.includes(pane)) pane.picture?.close();
    if (!same) for (const pane of this.panes) clear(pane);
    if (this.main) this.main.title = titleOf(name);
    if (same) for (const pane of this.panes) this.place(pane);
    this.tell();
  }

  private async load(pane: Pane, name: string, version: bigint, signal: AbortSignal): Promise<void> {
    const info = await loadSubject(name, version, signal);
    signal.throwIfAborted();
    pane.info = info;
    this.start(pane);
    this.tell();
  }

  private async loadBeside(signal: AbortSignal): Promise<void> {
    const loads = this.panes.map(async (pane) => {
      if (pane.info || pane.key === 'main') return;
      try {
        const { name, version, title } = resolve(pane.key, this.main?.info?.family);
        pane.title = title;
        await this.load(pane, name, version, signal);
      } catch (error) {
        if (!isAbort(error)) this.setError(pane, toApiError(error));
      }
    });
    await Promise.all(loads);
  }

  // Begins once both the picture and what it shows are there.
  private start(pane: Pane): void {
    if (!pane.picture || !pane.info) return;
    const player = pane.picture.open(pane.info, this.settings(pane));
    if (document.hidden) player.hold();
    this.place(pane);
  }

  // Camera and time as the state has them.
  private place(pane: Pane): void {
    const { picture } = pane;
    if (!picture?.player) return;
    const { state } = this;
    const index = this.panes.indexOf(pane);
    picture.setOrbit(paneOf(state, state.oneCamera ? 0 : index).orbit);
    const { timeS } = paneOf(state, state.oneTime ? 0 : index);
    const { player } = picture;
    const plays = pane === this.main ? state.playing : player.playing && !state.oneTime;
    if (!plays) player.pause();
    if (!player.playing) player.seek(timeS, !plays);
    if (plays) player.play();
  }

  private leads(pane: Pane): boolean {
    return pane === this.main && this.state.oneTime;
  }

  private follow(timeS: number, last: boolean): void {
    for (const pane of this.panes.slice(1)) pane.picture?.player?.seek(timeS, last);
  }

  private onShown(pane: Pane, frame: FrameInfo): void {
    if (pane === this.main) this.takeWeights(pane, frame.weights);
    if (!pane.picture?.player?.playing) return;
    this.times.set(pane);
    if (this.leads(pane)) this.follow(frame.timeS, false);
  }

  // Takes the server's weights of a point: of a link, and in a smooth family, the page has none.
  private takeWeights(pane: Pane, exact: number[]): void {
    const { point, weights: known } = this.state;
    if (!point.length || (known.length && !isSmooth(pane))) return;
    const weights = exact.map((weight) => roundTo(weight, 6));
    if (String(weights) === String(known)) return;
    this.states.set({ ...this.state, weights });
    for (const pane of this.panes.slice(1)) pane.picture?.player?.configure(this.settings(pane));
    this.tell();
  }

  private onPlayerChanged(pane: Pane): void {
    const player = pane.picture?.player;
    if (!player) return;
    const index = this.panes.indexOf(pane);
    if (index === 0 || !this.state.oneTime) this.setPane(index, { timeS: player.timeS });
    if (index === 0 && player.playing !== this.state.playing) {
      this.states.set({ ...this.state, playing: player.playing });
    }
    this.times.set(pane);
    const told = `${player.playing} ${player.connection}`;
    if (told !== pane.told) this.tell();
    pane.told = told;
  }

  private setPane(index: number, change: Partial<PaneState>): void {
    const panes = [...this.state.panes];
    for (let i = panes.length; i <= index; ++i) panes.push(paneOf(this.state, i));
    panes[index] = { ...panes[index]!, ...change };
    this.states.set({ ...this.state, panes });
  }

  private applyLook(): void {
    for (const { picture } of this.panes) picture?.setLook(this.look);
  }

  private setError(pane: Pane, error: ApiError | undefined): void {
    if (pane.error === error) return;
    pane.error = error;
    this.tell();
  }

  private tell(): void {
    this.changes.set(this.changes.value + 1);
  }
}
