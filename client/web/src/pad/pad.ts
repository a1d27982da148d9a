// The pad: a family's points in one or two of its parameters, the triangles between them, and a
// marker that asks for the blend at its place.
import { LitElement, html, nothing, svg } from 'lit';
import { customElement, property, query, state } from 'lit/decorators.js';
import { checkedOf, numberOf, textOf } from '../base/events.ts';
import { clamp, roundTo, sum } from '../base/numbers.ts';
import { Observing } from '../base/observing.ts';
import { controls } from '../base/styles.ts';
import type { Family } from '../generated/liquidblend/v1/liquidblend_pb.ts';
import type { ViewModel } from '../view/model.ts';
import { familySpace, type FamilySpace } from './family_space.ts';
import {
  padHeight,
  padWidth,
  placeOf,
  scaledAt,
  seenPlace,
  type Axes,
  type Place,
} from './pad_frame.ts';
import { padStyles } from './pad_styles.ts';
import { renderNames, renderPoints, renderSimplices } from './pad_picture.ts';
import type { Location, Point } from './space.ts';

const snapDistance = 7;  // in the picture
const reach = 0.35;  // how far outside of the ranges the marker goes
const keyStep = 0.01;
const keyLeap = 0.1;

const arrows: Record<string, [number, number]> = {
  ArrowLeft: [-1, 0],
  ArrowRight: [1, 0],
  ArrowUp: [0, 1],
  ArrowDown: [0, -1],
};

@customElement('lb-pad')
export class Pad extends LitElement {
  static override styles = [controls, padStyles];

  @property({ attribute: false }) model!: ViewModel;
  @state() private shown: FamilySpace | undefined;
  @state() private axes: Axes = [0, 0];
  @state() private asked: Point | undefined;  // where the person put the marker
  @state() private extrapolate = false;
  @query('svg') private picture!: SVGSVGElement;
  private loaded: unknown;
  private sent: Point = [];  // what the model has of `asked`
  private wanted: Point | undefined;  // until the next animation frame
  readonly observing = new Observing(
    this,
    () => this.model.changes,
    () => this.onModel(),
  );

  override connectedCallback(): void {
    super.connectedCallback();
    this.onModel();
  }

  override render() {
    const { shown } = this;
    if (!shown) return nothing;
    const point = this.point;
    const location = shown.space.locate(point);
    return html`
      <h3>Parameters</h3>
      ${shown.space.names.length > 2 ? this.renderAxes() : nothing}
      ${this.renderPicture(shown, point, location)}
      ${shown.space.names.map((name, index) => this.renderValue(name, index, point))}
      <label class="check">
        <input type="checkbox" .checked=${this.extrapolate} @change=${this.onExtrapolate} />
        Extrapolate outside of the hull
      </label>
      <p class="note" role="status">${this.outsideText(location)}</p>
      ${this.renderWeights(shown, location)}
    `;
  }

  // Where the marker is: as asked for, as the URL says, or where the weights are.
  private get point(): Point {
    if (this.asked) return this.asked;
    const { point, weights } = this.model.state;
    const { names, points } = this.shown!.space;
    if (point.length === names.length) return point;
    const all = [1 - sum(weights), ...weights];
    return names.map((_, i) => sum(points.map((at, k) => (all[k] ?? 0) * at[i]!)));
  }

  private renderAxes() {
    const { names } = this.shown!.space;
    const choose = (axis: 0 | 1) => (event: Event) => {
      const axes: Axes = [...this.axes];
      axes[axis] = Number(textOf(event));
      if (axes[0] === axes[1]) axes[1 - axis] = this.axes[axis];
      this.axes = axes;
    };
    return html`<div class="axes">
      ${([0, 1] as const).map(
        (axis) => html`<label>${axis ? 'up' : 'right'}
        <select @change=${choose(axis)}>
          ${names.map((name, i) => html`<option value=${i}
            .selected=${i === this.axes[axis]}>${name}</option>`)}
        </select>
      </label>`,
      )}
    </div>`;
  }

  private renderPicture(
    { space, labels }: FamilySpace,
    point: Point,
    location: Location | undefined,
  ) {
    return html`<svg
      viewBox="0 0 ${padWidth} ${padHeight}"
      @pointerdown=${this.onPointerDown}
      @pointermove=${this.onPointerMove}
    >
      ${renderSimplices(space, this.axes)} ${renderPoints(space, labels, this.axes)}
      ${renderNames(space.names, this.axes)} ${this.renderMarker(point, location)}
    </svg>`;
  }

  private renderMarker(point: Point, location: Location | undefined) {
    const { space } = this.shown!;
    const at = seenPlace(placeOf(space.scale(point), this.axes));
    const isOutside = location?.isOutside ?? false;
    const used =
      isOutside && !this.extrapolate ? placeOf(space.scale(location!.nearest), this.axes) : at;
    return svg`
      ${
        used === at
          ? nothing
          : svg`
        <line class="way" x1=${at.x} y1=${at.y} x2=${used.x} y2=${used.y} />
        <circle class="used" cx=${used.x} cy=${used.y} r="6" />`
      }
      <g class="marker ${isOutside ? 'outside' : ''}" tabindex="0" role="application"
        aria-roledescription="point" aria-label=${this.markerText(point)} @keydown=${this.onKey}>
        <circle class="ring" cx=${at.x} cy=${at.y} r="10" />
        <circle class=${used === at ? 'dot' : 'hollow'} cx=${at.x} cy=${at.y} r="5" />
      </g>`;
  }

  private markerText(point: Point): string {
    const values = this.shown!.space.names.map((name, i) => `${name} ${roundTo(point[i]!, 4)}`);
    const keys = 'Arrow keys move it, with Shift further.';
    return `Point in parameter space: ${values.join(', ')}. ${keys}`;
  }

  private renderValue(name: string, index: number, point: Point) {
    const [low, high] = this.rangeOf(index);
    const set = (event: Event) => {
      const value = numberOf(event);
      if (Number.isFinite(value)) this.move(point.map((old, i) => (i === index ? value : old)));
    };
    return html`<div class="value">
      <label for=${`value${index}`}>${name}</label>
      <input id=${`value${index}`} type="number" step="any"
        .value=${String(roundTo(point[index]!, 6))} @change=${set} />
      ${
        this.axes.includes(index)
          ? nothing
          : html`<input type="range" aria-label=${`${name}, slider`} min=${low} max=${high}
            step=${(high - low) / 1000}
            .value=${String(point[index])} @input=${set} />`
      }
    </div>`;
  }

  private renderWeights({ labels, isSmooth }: FamilySpace, location: Location | undefined) {
    const weights = this.weights(isSmooth, location);
    if (!weights) return nothing;
    const all = [1 - sum(weights), ...weights];
    return html`<dl class="weights" aria-label="Weights of this point">
      ${labels.map(
        (label, i) => html`<div class=${Math.abs(all[i]!) < 1e-9 ? 'none' : ''}>
        <dt>${label}</dt><dd>${(all[i] ?? 0).toFixed(4)}</dd>
      </div>`,
      )}
    </dl>`;
  }

  /** Of all targets, as the picture has them or will have them; undefined: not known yet. */
  private weights(isSmooth: boolean, location: Location | undefined): number[] | undefined {
    if (isSmooth || !location) return this.model.main?.picture?.shown?.info.weights;
    return location.isOutside && !this.extrapolate ? location.nearestWeights : location.weights;
  }

  private outsideText(location: Location | undefined): string {
    if (!location?.isOutside) return '';
    const far = `${(100 * location.distance).toFixed(0)} % of the ranges`;
    return this.extrapolate
      ? `Outside of the hull by ${far}: extrapolated.`
      : `Outside of the hull by ${far}: the hull's nearest point is shown.`;
  }

  private onModel(): void {
    const { model } = this;
    const { info } = model.main ?? {};
    if (info?.family && info !== this.loaded) {
      this.loaded = info;
      this.show(info.family);
    }
    // Sliders of weights, or another place in the URL, take the marker along.
    const { point, extrapolate } = model.state;
    if (this.asked && String(point) !== String(this.sent)) {
      this.asked = undefined;
      this.extrapolate = extrapolate;
    }
    this.requestUpdate();
  }

  private show(family: Family): void {
    this.asked = undefined;
    this.shown = familySpace(family);
    this.axes = this.shown && this.shown.space.names.length > 1 ? [0, 1] : [0, 0];
    this.extrapolate = this.model.state.extrapolate;
  }

  private onExtrapolate(event: Event): void {
    this.extrapolate = checkedOf(event);
    this.move(this.point);
  }

  private onPointerDown(event: PointerEvent): void {
    this.picture.setPointerCapture(event.pointerId);
    this.picture.querySelector<SVGGElement>('.marker')?.focus({ preventScroll: true });
    event.preventDefault();
    this.follow(event);
  }

  private onPointerMove(event: PointerEvent): void {
    if (this.picture.hasPointerCapture(event.pointerId)) this.follow(event);
  }

  private follow(event: PointerEvent): void {
    const { space } = this.shown!;
    const place = this.placeOfPointer(event);
    const near = event.altKey ? undefined : this.pointNear(place);
    const scaled = scaledAt(place, this.axes, space.scale(this.point));
    this.moveSoon(near ?? space.unscale(scaled.map((value) => clamp(value, -reach, 1 + reach))));
  }

  private placeOfPointer(event: PointerEvent): Place {
    const box = this.picture.getBoundingClientRect();
    return {
      x: ((event.clientX - box.left) * padWidth) / box.width,
      y: ((event.clientY - box.top) * padHeight) / box.height,
    };
  }

  // Only where the picture shows all parameters: a point of others may lie behind.
  private pointNear({ x, y }: Place): Point | undefined {
    const { space } = this.shown!;
    if (space.names.length > 2) return undefined;
    return space.points.find((point) => {
      const at = placeOf(space.scale(point), this.axes);
      return Math.hypot(at.x - x, at.y - y) < snapDistance;
    });
  }

  private onKey(event: KeyboardEvent): void {
    const way = arrows[event.key];
    if (!way || event.ctrlKey || event.metaKey || event.altKey) return;
    event.preventDefault();
    event.stopPropagation();
    const { space } = this.shown!;
    const step = event.shiftKey ? keyLeap : keyStep;
    const [x, y] = this.axes;
    const scaled = space.scale(this.wanted ?? this.point);
    const moved = [...scaled];
    if (x !== y) moved[y] = clamp(scaled[y]! + step * way[1], -reach, 1 + reach);
    moved[x] = clamp(scaled[x]! + step * (x === y ? way[0] + way[1] : way[0]), -reach, 1 + reach);
    this.moveSoon(space.unscale(moved));
  }

  // Pointers tell up to 1000 times a second.
  private moveSoon(point: Point): void {
    const waits = this.wanted !== undefined;
    this.wanted = point;
    if (!waits) requestAnimationFrame(() => this.moveWanted());
  }

  private moveWanted(): void {
    const { wanted } = this;
    this.wanted = undefined;
    if (wanted && this.shown) this.move(wanted);
  }

  private move(point: Point): void {
    const { space, isSmooth } = this.shown!;
    const asked = this.rounded(point);
    const location = space.locate(asked);
    const beyond = (location?.isOutside ?? false) && this.extrapolate;
    const used = location && !beyond ? location.nearest : asked;
    this.asked = asked;
    this.sent = used;
    this.model.setPoint(used, beyond, this.weights(isSmooth, location) ?? this.model.state.weights);
  }

  /** From the least to the largest value of the family's animations. */
  private rangeOf(index: number): [number, number] {
    const values = this.shown!.space.points.map((point) => point[index]!);
    return [Math.min(...values), Math.max(...values)];
  }

  // To a millionth of the range, so that the URL is short; values of animations stay as they are.
  private rounded(point: Point): Point {
    return point.map((value, i) => {
      if (this.shown!.space.points.some((at) => at[i] === value)) return value;
      const [low, high] = this.rangeOf(i);
      return roundTo(value, clamp(6 - Math.floor(Math.log10(high - low)), 0, 12));
    });
  }
}
