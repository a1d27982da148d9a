// One animation as it was imported, with the markers of all pairs and a time cursor of its own.
import { LitElement, html, nothing } from 'lit';
import { customElement, property, query, state } from 'lit/decorators.js';
import { repeat } from 'lit/directives/repeat.js';
import type { ApiError } from '../api/errors.ts';
import { shortName } from '../api/names.ts';
import '../base/error_message.ts';
import { controls } from '../base/styles.ts';
import { theme } from '../base/theme.ts';
import type { SubjectInfo } from '../view/subject.ts';
import type { Camera, Pixel } from './camera.ts';
import { editPaneStyles } from './edit_pane_styles.ts';
import { EditPicture } from './edit_picture.ts';
import { renderMark, renderPath, renderTicks, type MarkEvents } from './mark_view.ts';
import { automaticMarks, ownMarks, type Mark } from './marks.ts';
import type { EditorModel } from './model.ts';
import { pairOf, type Pair, type Side, type SpaceTime, type Vector } from './pairs.ts';
import { placeAt, type Path } from './path.ts';
import { Paths } from './paths.ts';

const clickPixels = 4;  // a pointer that moves further drags
const keyPixels = 6;
const finePixels = 1;

const canvasKeys =
  'Enter marks the place in the middle. Arrow keys turn the picture, with Shift they move it, ' +
  'plus and minus zoom.';

const arrows: Record<string, Pixel> = {
  ArrowLeft: { x: -1, y: 0 },
  ArrowRight: { x: 1, y: 0 },
  ArrowUp: { x: 0, y: -1 },
  ArrowDown: { x: 0, y: 1 },
};

function isClick(down: Pixel | undefined, up: Pixel): boolean {
  return !!down && Math.hypot(up.x - down.x, up.y - down.y) <= clickPixels;
}

@customElement('lb-edit-pane')
export class EditPane extends LitElement {
  static override styles = [controls, editPaneStyles];

  @property({ attribute: false }) model!: EditorModel;
  @property() side: Side = 'source';
  @state() private error: ApiError | undefined;
  @state() private broken = '';
  @state() private dragged: { number: number; place: SpaceTime } | undefined;
  @query('canvas') private canvas!: HTMLCanvasElement;
  private picture: EditPicture | undefined;
  private readonly paths = new Paths(() => this.requestUpdate());
  private down: Pixel | undefined;
  private dragPixel: Pixel | undefined;  // until the next animation frame
  private unsubscribes: (() => void)[] = [];
  private readonly markEvents: MarkEvents = {
    down: (event, mark) => this.onMarkDown(event, mark),
    move: (event) => this.onMarkMove(event),
    up: (event, mark) => this.onMarkUp(event, mark),
    key: (event, mark) => this.onMarkKey(event, mark),
    focus: (mark) => this.onMarkFocus(mark),
  };

  override connectedCallback(): void {
    super.connectedCallback();
    this.unsubscribes = [
      this.model.changes.subscribe(() => this.onModel()),
      this.model.moves.subscribe(() => this.onMove()),
      theme.subscribe(() => this.picture?.applyTheme()),
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
      this.picture = new EditPicture(this.canvas, {
        changed: () => this.requestUpdate(),
        error: (error) => (this.error = error),
        orbit: (orbit) => this.model.setOrbit(this.side, orbit),
      });
      this.onModel();
      this.onMove();
    } catch (error) {
      const why = error instanceof Error ? error.message : String(error);
      this.broken = `This browser cannot draw it: ${why}`;
    }
  }

  /** Whether the picture shows the frame of the cursor, so that it can be marked. */
  get ready(): boolean {
    return this.picture?.ready ?? false;
  }

  focusPicture(): void {
    this.canvas.focus({ preventScroll: true });
  }

  private get info(): SubjectInfo | undefined {
    return this.model.infos[this.side];
  }

  private get timeS(): number {
    return this.model.times[this.side];
  }

  override render() {
    const { side, info, model } = this;
    const wanted = model.pairs.wantedSide === side;
    const name = shortName(info?.subject.name ?? '');
    return html`
      <div class="picture">
        <canvas
          tabindex="0"
          role="application"
          aria-label=${`${side}: ${name}. ${canvasKeys}`}
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
    const { picture } = this;
    const camera = picture?.camera();
    if (!picture || !camera) return nothing;
    const { width, height } = picture.size;
    const cross = `M${width / 2 - 9} ${height / 2}h18M${width / 2} ${height / 2 - 9}v18`;
    return html`<svg role="group" aria-label=${`Markers of the ${this.side}`}>
      <path class="cross" d=${cross} />
      ${this.pairs().map((pair) => renderPath(this.pathOf(pair), pair.number, camera))}
      ${repeat(
        this.marks(camera),
        ({ id }) => id,
        (mark) => renderMark(mark, this.isChosen(mark), this.markEvents),
      )}
    </svg>`;
  }

  private marks(camera: Camera): Mark[] {
    const { side, timeS, model } = this;
    const placeOf = (pair: Pair, place: SpaceTime) => this.placeOf(pair, place);
    const own = ownMarks(this.pairs(), side, timeS, camera, placeOf);
    if (!model.showsAutomatic) return own;
    return [...automaticMarks(model.automatic, model.list.dropped, side, timeS, camera), ...own];
  }

  private isChosen({ number, key }: Mark): boolean {
    return number ? number === this.model.selected : key === this.model.selectedAutomatic;
  }

  private renderTime() {
    const { model, side, timeS } = this;
    const duration = model.durationS(side);
    const frameS = model.frameS(side);
    const frame = Math.round(timeS / frameS);
    const number = (this.info?.animation?.firstFrameNumber ?? 0) + frame;
    const set = (event: Event) =>
      model.setTime(side, Number((event.target as HTMLInputElement).value) * frameS);
    return html`<div class="time">
      <div class="track">
        <svg class="ticks" viewBox="0 0 100 12" preserveAspectRatio="none" aria-hidden="true">
          ${renderTicks(this.pairs(), side, duration)}
        </svg>
        <input
          type="range"
          min="0"
          max=${Math.round(duration / frameS)}
          step="1"
          .value=${String(frame)}
          aria-label=${`Time of the ${side}`}
          aria-valuetext=${`${timeS.toFixed(2)} seconds, frame ${number}`}
          @input=${set}
        />
      </div>
      <output>${timeS.toFixed(2)} s, frame ${number}</output>
    </div>`;
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
    const isDragged = this.dragged?.number === pair.number;
    if (pair.kind !== 'TRAJECTORY' || !place || !this.info || isDragged) return [];
    return this.paths.get(this.info, place, pair.lengthS);
  }

  private placeOf(pair: Pair, place: SpaceTime): Vector {
    return pair.kind === 'TRAJECTORY'
      ? placeAt(this.pathOf(pair), place, this.timeS)
      : place.position;
  }

  private onModel(): void {
    if (this.info) this.picture?.show(this.info, this.timeS);
    this.requestUpdate();
  }

  private onMove(): void {
    this.picture?.setOrbit(this.model.orbits[this.side]);
    this.requestUpdate();
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
    const pixel = this.pixelOf(event);
    if (isClick(this.down, pixel)) this.add(pixel);
    this.down = undefined;
  }

  private onCanvasKey(event: KeyboardEvent): void {
    if (event.key !== 'Enter' || !this.picture) return;
    event.preventDefault();
    const { width, height } = this.picture.size;
    this.add({ x: width / 2, y: height / 2 });
  }

  private add(pixel: Pixel): void {
    const position = this.picture?.placeAt(pixel);
    if (position) this.model.addPlace(this.side, { position, timeS: this.timeS });
  }

  private onMarkDown(event: PointerEvent, mark: Mark): void {
    event.preventDefault();
    const element = event.currentTarget as SVGGElement;
    element.focus({ preventScroll: true });
    this.down = undefined;
    if (event.ctrlKey || event.metaKey) {
      if (mark.number) this.model.pairs.toggleEnabled(mark.number);
      return;
    }
    element.setPointerCapture(event.pointerId);
    this.down = this.pixelOf(event);
  }

  private onMarkMove(event: PointerEvent): void {
    const element = event.currentTarget as SVGGElement;
    if (!this.down || !element.hasPointerCapture(event.pointerId)) return;
    const pixel = this.pixelOf(event);
    if (!this.dragged && isClick(this.down, pixel)) return;
    const waits = !!this.dragPixel;
    this.dragPixel = pixel;
    if (!waits) requestAnimationFrame(() => this.drag());
  }

  private drag(): void {
    const { dragPixel, picture } = this;
    const pair = pairOf(this.model.list, this.model.selected);
    this.dragPixel = undefined;
    if (!dragPixel || !this.down || !pair) return;
    const position = picture?.placeAt(dragPixel) ?? this.besideSurface(dragPixel, pair);
    if (position) this.dragged = { number: pair.number, place: { position, timeS: this.timeS } };
  }

  // The target of a space may be anywhere.
  private besideSurface(pixel: Pixel, pair: Pair): Vector | undefined {
    const place = pair[this.side];
    const isFree = pair.kind === 'SPACE' && this.side === 'target';
    return isFree && place ? this.picture?.beside(pixel, place.position) : undefined;
  }

  private onMarkUp(event: PointerEvent, mark: Mark): void {
    if (this.dragPixel) this.drag();
    const { down, dragged } = this;
    this.down = this.dragged = undefined;
    if (dragged) this.model.pairs.movePlace(dragged.number, this.side, dragged.place);
    else if (isClick(down, this.pixelOf(event))) this.goTo(mark);
  }

  private onMarkFocus(mark: Mark): void {
    if (this.isChosen(mark)) return;
    if (mark.number) this.model.select(mark.number);
    else this.model.selectAutomatic(mark.key);
  }

  private goTo({ number, key }: Mark): void {
    if (number) return this.model.goTo(number);
    const found = this.model.automatic.find((one) => one.key === key);
    if (found) this.model.goToAutomatic(found);
  }

  private onMarkKey(event: KeyboardEvent, mark: Mark): void {
    if (event.ctrlKey || event.metaKey || event.altKey) return;
    const way = arrows[event.key];
    const goes = event.key === 'Enter' || event.key === ' ';
    if (!goes && !(way && mark.number)) return;
    event.preventDefault();
    event.stopPropagation();
    if (way) this.nudge(mark, way, event.shiftKey ? finePixels : keyPixels);
    else this.goTo(mark);
  }

  // To the part of the surface that the place is on already, even if another one hides it. The
  // first key only shows the place's time.
  private nudge(mark: Mark, way: Pixel, pixels: number): void {
    const pair = pairOf(this.model.list, mark.number);
    const place = pair?.[this.side];
    if (!pair || !place) return;
    if (Math.abs(place.timeS - this.timeS) > this.model.frameS(this.side) / 2)
      return this.goTo(mark);
    const pixel = { x: mark.x + way.x * pixels, y: mark.y + way.y * pixels };
    const position =
      this.picture?.placeAt(pixel, place.position) ?? this.besideSurface(pixel, pair);
    if (position)
      this.model.pairs.movePlace(pair.number, this.side, { position, timeS: this.timeS });
  }
}

declare global {
  interface HTMLElementTagNameMap {
    'lb-edit-pane': EditPane;
  }
}
