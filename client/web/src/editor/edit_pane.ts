// One animation as it was imported, with the markers of all pairs and a time cursor of its own.
import { LitElement, html, nothing, svg } from 'lit';
import { customElement, property, query, state } from 'lit/decorators.js';
import { repeat } from 'lit/directives/repeat.js';
import type { ApiError } from '../api/errors.ts';
import { shortName } from '../api/names.ts';
import '../base/error_message.ts';
import { controls } from '../base/styles.ts';
import { theme } from '../base/theme.ts';
import { OrbitInput } from '../scene/orbit_input.ts';
import { sharedPool } from '../stream/decoder_pool.ts';
import type { PlayerSettings } from '../stream/player.ts';
import { Picture } from '../view/picture.ts';
import type { SubjectInfo } from '../view/subject.ts';
import { Camera, type Pixel, type Rotation } from './camera.ts';
import { colourOf } from './colours.ts';
import { editPaneStyles } from './edit_pane_styles.ts';
import { automaticMarks, ownMarks, type Mark } from './marks.ts';
import type { EditorModel } from './model.ts';
import { pairOf, type Pair, type Side, type SpaceTime, type Vector } from './pairs.ts';
import { placeAt, type Path } from './path.ts';
import { Paths } from './paths.ts';
import { atDepthOf, firstHit, hitNearest, type Triangles } from './picker.ts';

const clickPixels = 4;  // a pointer that moves further drags
const keyPixels = 6;
const finePixels = 1;

const still: PlayerSettings = {
  blend: { weights: [] },
  rate: 1,
  loop: 'off',
  range: [0, 0],
  framesPerSecond: 0,
  level: 0,
  wanted: { normals: true, velocities: false, edges: false },
};

const arrows: Record<string, Pixel> = {
  ArrowLeft: { x: -1, y: 0 },
  ArrowRight: { x: 1, y: 0 },
  ArrowUp: { x: 0, y: -1 },
  ArrowDown: { x: 0, y: 1 },
};

@customElement('lb-edit-pane')
export class EditPane extends LitElement {
  static override styles = [controls, editPaneStyles];

  @property({ attribute: false }) model!: EditorModel;
  @property() side: Side = 'source';
  @state() private error: ApiError | undefined;
  @state() private broken = '';
  @state() private dragged: { number: number; place: SpaceTime } | undefined;
  @query('canvas') private canvas!: HTMLCanvasElement;
  private picture: Picture | undefined;
  private shownInfo: SubjectInfo | undefined;
  private shownTimeS = -1;
  private readonly paths = new Paths(() => this.requestUpdate());
  private down: Pixel | undefined;
  private dragPixel: Pixel | undefined;  // until the next animation frame
  private unsubscribes: (() => void)[] = [];

  override connectedCallback(): void {
    super.connectedCallback();
    this.unsubscribes = [
      this.model.changes.subscribe(() => this.onModel()),
      this.model.moves.subscribe(() => this.onMove()),
      theme.subscribe(() => this.applyTheme()),
    ];
  }

  override disconnectedCallback(): void {
    for (const unsubscribe of this.unsubscribes) unsubscribe();
    this.paths.close();
    this.picture?.close();
    super.disconnectedCallback();
  }

  override firstUpdated(): void {
    try {
      this.begin();
      this.onModel();
    } catch (error) {
      this.broken = `This browser cannot draw it: ${error instanceof Error ? error.message : error}`;
    }
  }

  focusPicture(): void {
    this.canvas.focus({ preventScroll: true });
  }

  /** Whether the picture shows the frame of the cursor, so that it can be marked. */
  get ready(): boolean {
    return !!this.surface();
  }

  private get info(): SubjectInfo | undefined {
    return this.model.infos[this.side];
  }

  private get timeS(): number {
    return this.model.times[this.side];
  }

  override render() {
    const { side, info, model } = this;
    const wanted = model.wantedSide === side;
    const name = shortName(info?.subject.name ?? '');
    return html`
      <div class="picture">
        <canvas
          tabindex="0"
          role="application"
          aria-label=${`${side}: ${name}. Enter marks the place in the middle. Arrow keys turn the picture, with Shift they move it, plus and minus zoom.`}
          @pointerdown=${this.onPointerDown}
          @pointerup=${this.onPointerUp}
          @keydown=${this.onCanvasKey}
        ></canvas>
        ${this.renderOverlay()}
        <div class="title ${wanted ? 'wanted' : ''}">
          <span class="role">${side}</span> ${name}${wanted ? ': now click here' : ''}
        </div>
        ${this.broken ? html`<p class="title">${this.broken}</p>` : nothing}
        <lb-error .error=${this.error}></lb-error>
      </div>
      ${this.renderTime()}
    `;
  }

  private renderOverlay() {
    const camera = this.camera();
    if (!camera) return html`<svg aria-hidden="true"></svg>`;
    const { width, height } = this.size;
    const cross = `M${width / 2 - 9} ${height / 2}h18M${width / 2} ${height / 2 - 9}v18`;
    const own = ownMarks(this.pairs(), this.side, this.timeS, camera, (pair, place) => this.placeOf(pair, place));
    const { automatic, list } = this.model;
    const found = this.model.showsAutomatic
      ? automaticMarks(automatic, list.dropped, this.side, this.timeS, camera)
      : [];
    const isChosen = (mark: Mark) =>
      mark.number ? mark.number === this.model.selected : mark.key === this.model.selectedAutomatic;
    return html`<svg role="group" aria-label=${`Markers of the ${this.side}`}>
      <path class="cross" d=${cross} />
      ${this.pairs().map((pair) => this.renderPath(pair, camera))}
      ${repeat([...found, ...own], ({ id }) => id, (mark) => this.renderMark(mark, isChosen(mark)))}
    </svg>`;
  }

  private renderMark(mark: Mark, chosen: boolean) {
    const { x, y, number, label, colour, opacity, pair } = mark;
    const states = { selected: chosen, off: !pair.enabled, check: pair.check, automatic: !number };
    const classes = Object.entries(states).filter(([, on]) => on).map(([name]) => name);
    return svg`<g
      class=${['mark', ...classes].join(' ')}
      transform=${`translate(${x.toFixed(1)} ${y.toFixed(1)})`}
      opacity=${chosen ? 1 : opacity.toFixed(2)}
      tabindex="0"
      role="button"
      aria-pressed=${chosen ? 'true' : 'false'}
      aria-label=${mark.about}
      @pointerdown=${(event: PointerEvent) => this.onMarkDown(event, mark)}
      @pointermove=${(event: PointerEvent) => this.onMarkMove(event)}
      @pointerup=${(event: PointerEvent) => this.onMarkUp(event, mark)}
      @keydown=${(event: KeyboardEvent) => this.onMarkKey(event, mark)}
      @focus=${() => this.onMarkFocus(mark)}
    >
      <circle class="halo" r=${number ? 13 : 9} />
      ${number ? this.renderBody(pair, colour) : svg`<circle class="body" fill=${colour} r="5" />`}
      <text x=${number ? 0 : 16} y="0.5">${label}</text>
    </g>`;
  }

  // Hard: a square. Space: a diamond. Soft points and trajectories: a circle.
  private renderBody({ kind, hard }: Omit<Pair, 'number'>, colour: string) {
    if (kind === 'SPACE') return svg`<path class="body" fill=${colour} d="M0 -11L11 0L0 11L-11 0z" />`;
    if (hard) return svg`<rect class="body" fill=${colour} x="-9" y="-9" width="18" height="18" rx="2" />`;
    return svg`<circle class="body" fill=${colour} r="9.5" />`;
  }

  private renderPath(pair: Pair, camera: Camera) {
    const path = this.pathOf(pair);
    if (path.length < 2) return nothing;
    const seen = path.map(({ position }) => camera.see(position)).filter(({ depth }) => depth > 0);
    const points = seen.map(({ x, y }) => `${x.toFixed(1)},${y.toFixed(1)}`).join(' ');
    const colour = colourOf(pair.number);
    return svg`<polyline class="path" points=${points} stroke=${colour} />
      ${seen.slice(1).map(({ x, y }) => svg`<circle cx=${x} cy=${y} r="2" fill=${colour} />`)}`;
  }

  private renderTime() {
    const { model, side } = this;
    const duration = model.durationS(side);
    const frameS = model.frameS(side);
    const frame = Math.round(this.timeS / frameS);
    const number = (this.info?.animation?.firstFrameNumber ?? 0) + frame;
    return html`<div class="time">
      <div class="track">
        ${this.renderTicks(duration)}
        <input
          type="range"
          min="0"
          max=${Math.round(duration / frameS)}
          step="1"
          .value=${String(frame)}
          aria-label=${`Time of the ${side}`}
          aria-valuetext=${`${this.timeS.toFixed(2)} seconds, frame ${number}`}
          @input=${this.onTime}
        />
      </div>
      <output>${this.timeS.toFixed(2)} s, frame ${number}</output>
    </div>`;
  }

  // When each pair is, above the slider.
  private renderTicks(duration: number) {
    if (!(duration > 0)) return nothing;
    return html`<svg class="ticks" viewBox="0 0 100 12" preserveAspectRatio="none" aria-hidden="true">
      ${this.pairs().map((pair) => {
        const place = pair[this.side];
        if (!place) return nothing;
        const x = (100 * place.timeS) / duration;
        const end = pair.kind === 'POINT' ? x : pair.lengthS ? Math.min(100, x + (100 * pair.lengthS) / duration) : 100;
        const colour = colourOf(pair.number);
        return svg`<line x1=${x} x2=${x} y1="1" y2="11" stroke=${colour} stroke-width="2"
            vector-effect="non-scaling-stroke" />
          ${end > x ? svg`<line x1=${x} x2=${end} y1="6" y2="6" stroke=${colour} stroke-width="2"
            vector-effect="non-scaling-stroke" />` : nothing}`;
      })}
    </svg>`;
  }

  // The pairs, one of them as it is being dragged.
  private pairs(): readonly Pair[] {
    const { dragged } = this;
    const { pairs } = this.model.list;
    if (!dragged) return pairs;
    return pairs.map((pair) =>
      pair.number === dragged.number ? { ...pair, [this.side]: dragged.place } : pair,
    );
  }

  private pathOf(pair: Pair): Path {
    const place = pair[this.side];
    if (pair.kind !== 'TRAJECTORY' || !place || !this.info || this.dragged?.number === pair.number) return [];
    return this.paths.get(this.info, place, pair.lengthS);
  }

  private placeOf(pair: Pair, place: SpaceTime): Vector {
    return pair.kind === 'TRAJECTORY' ? placeAt(this.pathOf(pair), place, this.timeS) : place.position;
  }

  // ---- picture

  private begin(): void {
    const { canvas, model } = this;
    const picture = new Picture(canvas, sharedPool(), {
      shown: () => this.onShown(),
      changed: () => {},
      error: (error) => (this.error = error),
    });
    this.picture = picture;
    this.applyTheme();
    const resize = () => {
      picture.setSize(canvas.clientWidth, canvas.clientHeight);
      this.requestUpdate();
    };
    new ResizeObserver(resize).observe(canvas);
    new OrbitInput(canvas, {
      get orbit() {
        return picture.orbit;
      },
      get radius() {
        return picture.stage.sphere.radius;
      },
      move: (orbit) => model.setOrbit(this.side, orbit),
      reset: () => {},
    });
  }

  private applyTheme(): void {
    this.picture?.setLook({ shading: 'plain', wireframe: false, theme: theme.value });
  }

  private onModel(): void {
    const { picture, info } = this;
    if (picture && info && info !== this.shownInfo) {
      this.shownInfo = info;
      this.shownTimeS = -1;
      picture.open(info, still);
      picture.setOrbit(this.model.orbits[this.side]);
      this.paths.close();
    }
    if (picture?.player && info && this.timeS !== this.shownTimeS) {
      this.shownTimeS = this.timeS;
      picture.player.seek(this.timeS, true);
    }
    this.requestUpdate();
  }

  private onMove(): void {
    this.picture?.setOrbit(this.model.orbits[this.side]);
    this.requestUpdate();
  }

  private onShown(): void {
    this.requestUpdate();
  }

  private onTime(event: Event): void {
    const frame = Number((event.target as HTMLInputElement).value);
    this.model.setTime(this.side, frame * this.model.frameS(this.side));
  }

  private get size(): { width: number; height: number } {
    return { width: this.canvas?.clientWidth || 1, height: this.canvas?.clientHeight || 1 };
  }

  private camera(): Camera | undefined {
    const { picture, info } = this;
    if (!picture || !info) return undefined;
    const e = info.rotation.elements;
    const rotation: Rotation = [
      [e[0]!, e[1]!, e[2]!],
      [e[4]!, e[5]!, e[6]!],
      [e[8]!, e[9]!, e[10]!],
    ];
    const { width, height } = this.size;
    return new Camera(picture.orbit, rotation, width, height);
  }

  /** The surface that is shown; undefined while another frame than the cursor's is shown. */
  private surface(): Triangles | undefined {
    const { picture } = this;
    const shown = picture?.shown;
    if (!shown || Math.abs(shown.info.timeS - this.timeS) > this.model.frameS(this.side) / 2) return undefined;
    const { triangles } = picture.stage.surface;
    const position = triangles.getAttribute('position');
    if (!position || !triangles.index) return undefined;
    return { positions: position.array, indices: triangles.index.array, count: 3 * shown.counts.triangles };
  }

  // ---- places by pointer and keys

  private pixelOf(event: PointerEvent): Pixel {
    const box = this.canvas.getBoundingClientRect();
    return { x: event.clientX - box.left, y: event.clientY - box.top };
  }

  private onPointerDown(event: PointerEvent): void {
    const plain = event.button === 0 && !event.ctrlKey && !event.shiftKey && !event.metaKey;
    this.down = plain && event.isPrimary ? this.pixelOf(event) : undefined;
  }

  private onPointerUp(event: PointerEvent): void {
    const { down } = this;
    this.down = undefined;
    if (!down) return;
    const pixel = this.pixelOf(event);
    if (Math.hypot(pixel.x - down.x, pixel.y - down.y) <= clickPixels) this.add(pixel);
  }

  private onCanvasKey(event: KeyboardEvent): void {
    if (event.key !== 'Enter') return;
    event.preventDefault();
    const { width, height } = this.size;
    this.add({ x: width / 2, y: height / 2 });
  }

  private add(pixel: Pixel): void {
    const position = this.place(pixel, undefined);
    if (position) this.model.addPlace(this.side, { position, timeS: this.timeS });
  }

  // On the surface; the target of a space may be beside it.
  private place(pixel: Pixel, near: Vector | undefined): Vector | undefined {
    const surface = this.surface();
    const ray = this.camera()?.rayThrough(pixel);
    if (!surface || !ray) return undefined;
    return near ? hitNearest(ray, surface, near) : firstHit(ray, surface);
  }

  private onMarkDown(event: PointerEvent, mark: Mark): void {
    event.preventDefault();
    const element = event.currentTarget as SVGGElement;
    element.focus({ preventScroll: true });
    if (event.ctrlKey || event.metaKey) {
      this.down = undefined;
      if (mark.number) this.model.toggleEnabled(mark.number);
      return;
    }
    element.setPointerCapture(event.pointerId);
    this.down = this.pixelOf(event);
  }

  private onMarkMove(event: PointerEvent): void {
    const { down } = this;
    const element = event.currentTarget as SVGGElement;
    if (!down || !element.hasPointerCapture(event.pointerId)) return;
    const pixel = this.pixelOf(event);
    if (!this.dragged && Math.hypot(pixel.x - down.x, pixel.y - down.y) <= clickPixels) return;
    const waits = !!this.dragPixel;
    this.dragPixel = pixel;
    if (!waits) requestAnimationFrame(() => this.drag());
  }

  private drag(): void {
    const { dragPixel } = this;
    const { selected } = this.model;
    this.dragPixel = undefined;
    const pair = pairOf(this.model.list, selected);
    if (!dragPixel || !this.down || !pair) return;
    const position = this.place(dragPixel, undefined) ?? this.besideSurface(dragPixel, pair);
    if (position) this.dragged = { number: selected, place: { position, timeS: this.timeS } };
  }

  private besideSurface(pixel: Pixel, pair: Pair): Vector | undefined {
    const place = pair[this.side];
    const ray = this.camera()?.rayThrough(pixel);
    const isFree = pair.kind === 'SPACE' && this.side === 'target';
    return isFree && place && ray ? atDepthOf(ray, place.position) : undefined;
  }

  private onMarkUp(event: PointerEvent, mark: Mark): void {
    const { down, dragged } = this;
    const pixel = this.pixelOf(event);
    if (down && this.dragPixel) this.drag();
    this.down = undefined;
    const moved = this.dragged ?? dragged;
    this.dragged = undefined;
    if (moved) this.model.movePlace(moved.number, this.side, moved.place);
    else if (down && Math.hypot(pixel.x - down.x, pixel.y - down.y) <= clickPixels) this.goTo(mark);
  }

  private onMarkFocus({ number, key }: Mark): void {
    if (number && this.model.selected !== number) this.model.select(number);
    else if (key && this.model.selectedAutomatic !== key) {
      this.model.selected = 0;
      this.model.selectedAutomatic = key;
      this.model.tell();
    }
  }

  private goTo({ number, key }: Mark): void {
    if (number) return this.model.goTo(number);
    const found = this.model.automatic.find((one) => one.key === key);
    if (found) this.model.goToAutomatic(found);
  }

  private onMarkKey(event: KeyboardEvent, mark: Mark): void {
    if (event.key === 'Enter' || event.key === ' ') {
      event.preventDefault();
      event.stopPropagation();
      this.goTo(mark);
      return;
    }
    const way = arrows[event.key];
    if (!way || !mark.number || event.ctrlKey || event.metaKey || event.altKey) return;
    event.preventDefault();
    event.stopPropagation();
    this.nudge(mark, way, event.shiftKey ? finePixels : keyPixels);
  }

  // To the part of the surface that the place is on already, even if another one hides it. The first
  // key only shows the place's time.
  private nudge(mark: Mark, way: Pixel, pixels: number): void {
    const pair = pairOf(this.model.list, mark.number);
    const place = pair?.[this.side];
    if (!pair || !place) return;
    if (Math.abs(place.timeS - this.timeS) > this.model.frameS(this.side) / 2) return this.goTo(mark);
    const pixel = { x: mark.x + way.x * pixels, y: mark.y + way.y * pixels };
    const position = this.place(pixel, place.position) ?? this.besideSurface(pixel, pair);
    if (position) this.model.movePlace(mark.number, this.side, { position, timeS: this.timeS });
  }
}

declare global {
  interface HTMLElementTagNameMap {
    'lb-edit-pane': EditPane;
  }
}
