// One animation as it was imported, with the markers of all pairs and a time cursor of its own.
import { LitElement, html, nothing } from 'lit';
import { customElement, property, query, state } from 'lit/decorators.js';
import { repeat } from 'lit/directives/repeat.js';
import type { ApiError } from '../api/errors.ts';
import { shortName } from '../api/names.ts';
import '../base/error_message.ts';
import { controls } from '../base/styles.ts';
import { theme } from '../base/theme.ts';
import type { Pair, Side, SpaceTime, Vector } from '../pairs/pairs.ts';
import type { SubjectInfo } from '../view/subject.ts';
import type { Camera, Pixel } from './camera.ts';
import { editPaneStyles } from './edit_pane_styles.ts';
import { EditPicture } from './edit_picture.ts';
import { MarkInput, isClick, type MarkHost } from './mark_input.ts';
import { renderMark, renderPath, renderTicks } from './mark_view.ts';
import { automaticMarks, ownMarks, type Mark } from './marks.ts';
import type { EditorModel } from './model.ts';
import { placeAt, type Path } from './path.ts';
import { Paths } from './paths.ts';

const canvasKeys =
  'Enter marks the place in the middle. Arrow keys turn the picture, with Shift they move it, ' +
  'plus and minus zoom.';

@customElement('lb-edit-pane')
export class EditPane extends LitElement implements MarkHost {
  static override styles = [controls, editPaneStyles];

  @property({ attribute: false }) model!: EditorModel;
  @property() side: Side = 'source';
  @state() private error: ApiError | undefined;
  @state() private broken = '';
  @query('canvas') private canvas!: HTMLCanvasElement;
  picture: EditPicture | undefined;
  private readonly paths = new Paths(() => this.requestUpdate());
  private down: Pixel | undefined;
  private unsubscribes: (() => void)[] = [];
  private readonly markInput = new MarkInput(this);

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

  get timeS(): number {
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
        (mark) => renderMark(mark, this.isChosen(mark), this.markInput),
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

  isChosen({ number, key }: Mark): boolean {
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
    const { dragged } = this.markInput;
    const { pairs } = this.model.list;
    if (!dragged) return pairs;
    return pairs.map((pair) =>
      pair.number === dragged.number ? { ...pair, [this.side]: dragged.place } : pair,
    );
  }

  private pathOf(pair: Pair): Path {
    const place = pair[this.side];
    const isDragged = this.markInput.dragged?.number === pair.number;
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

  pixelOf(event: PointerEvent): Pixel {
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
}

declare global {
  interface HTMLElementTagNameMap {
    'lb-edit-pane': EditPane;
  }
}
