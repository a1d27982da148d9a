// Input on markers: dragged and clicked by pointer, moved and followed by keys.
import { pairOf, type Pair, type Side, type SpaceTime, type Vector } from '../pairs/pairs.ts';
import type { Pixel } from './camera.ts';
import type { EditPicture } from './edit_picture.ts';
import type { MarkEvents } from './mark_view.ts';
import type { Mark } from './marks.ts';
import type { EditorModel } from './model.ts';

const clickPixels = 4;  // a pointer that moves further drags
const keyPixels = 6;
const finePixels = 1;

const arrows: Record<string, Pixel> = {
  ArrowLeft: { x: -1, y: 0 },
  ArrowRight: { x: 1, y: 0 },
  ArrowUp: { x: 0, y: -1 },
  ArrowDown: { x: 0, y: 1 },
};

/** Whether a pointer that went down and up there has clicked. */
export function isClick(down: Pixel | undefined, up: Pixel): boolean {
  return !!down && Math.hypot(up.x - down.x, up.y - down.y) <= clickPixels;
}

/** The pane that the markers are on. */
export interface MarkHost {
  readonly model: EditorModel;
  readonly side: Side;
  readonly timeS: number;
  readonly picture: EditPicture | undefined;
  pixelOf(event: PointerEvent): Pixel;
  isChosen(mark: Mark): boolean;
  requestUpdate(): void;
}

export class MarkInput implements MarkEvents {
  /** The place that is being dragged, and the number of its pair. */
  dragged: { number: number; place: SpaceTime } | undefined;
  private pressed: { pixel: Pixel; number: number } | undefined;
  private dragPixel: Pixel | undefined;  // until the next animation frame

  constructor(private readonly host: MarkHost) {}

  down(event: PointerEvent, mark: Mark): void {
    event.preventDefault();
    const element = event.currentTarget as SVGGElement;
    element.focus({ preventScroll: true });
    this.focus(mark);
    this.cancel();
    if (event.ctrlKey || event.metaKey) {
      if (mark.number) this.host.model.pairs.toggleEnabled(mark.number);
      return;
    }
    element.setPointerCapture(event.pointerId);
    this.pressed = { pixel: this.host.pixelOf(event), number: mark.number };
  }

  move(event: PointerEvent): void {
    const element = event.currentTarget as SVGGElement;
    if (!this.pressed || !element.hasPointerCapture(event.pointerId)) return;
    const pixel = this.host.pixelOf(event);
    if (!this.dragged && isClick(this.pressed.pixel, pixel)) return;
    const waits = !!this.dragPixel;
    this.dragPixel = pixel;
    if (!waits) requestAnimationFrame(() => this.drag());
  }

  up(event: PointerEvent, mark: Mark): void {
    if (this.dragPixel) this.drag();
    const { pressed, dragged } = this;
    this.cancel();
    const { model, side } = this.host;
    if (dragged) model.pairs.movePlace(dragged.number, side, dragged.place);
    else if (isClick(pressed?.pixel, this.host.pixelOf(event))) this.goTo(mark);
  }

  cancel(): void {
    this.pressed = this.dragPixel = undefined;
    this.show(undefined);
  }

  key(event: KeyboardEvent, mark: Mark): void {
    if (event.ctrlKey || event.metaKey || event.altKey) return;
    const way = arrows[event.key];
    const goes = event.key === 'Enter' || event.key === ' ';
    if (!goes && !(way && mark.number)) return;
    event.preventDefault();
    event.stopPropagation();
    if (way) this.nudge(mark, way, event.shiftKey ? finePixels : keyPixels);
    else this.goTo(mark);
  }

  focus(mark: Mark): void {
    const { host } = this;
    if (host.isChosen(mark)) return;
    if (mark.number) host.model.select(mark.number);
    else host.model.selectAutomatic(mark.key);
  }

  private show(dragged: MarkInput['dragged']): void {
    this.dragged = dragged;
    this.host.requestUpdate();
  }

  private drag(): void {
    const { model, picture, timeS } = this.host;
    const { dragPixel, pressed } = this;
    const pair = pressed && pairOf(model.list, pressed.number);
    this.dragPixel = undefined;
    if (!dragPixel || !pair) return;
    const position = picture?.placeAt(dragPixel) ?? this.besideSurface(dragPixel, pair);
    if (position) this.show({ number: pair.number, place: { position, timeS } });
  }

  // The target of a space may be anywhere.
  private besideSurface(pixel: Pixel, pair: Pair): Vector | undefined {
    const { side, picture } = this.host;
    const place = pair[side];
    const isFree = pair.kind === 'SPACE' && side === 'target';
    return isFree && place ? picture?.beside(pixel, place.position) : undefined;
  }

  private goTo({ number, key }: Mark): void {
    const { model } = this.host;
    if (number) return model.goTo(number);
    const found = model.automatic.find((one) => one.key === key);
    if (found) model.goToAutomatic(found);
  }

  // To the part of the surface that the place is on already, even if another one hides it. The
  // first key only shows the place's time.
  private nudge(mark: Mark, way: Pixel, pixels: number): void {
    const { model, side, timeS, picture } = this.host;
    const pair = pairOf(model.list, mark.number);
    const place = pair?.[side];
    if (!pair || !place) return;
    if (Math.abs(place.timeS - timeS) > model.frameS(side) / 2) return this.goTo(mark);
    const pixel = { x: mark.x + way.x * pixels, y: mark.y + way.y * pixels };
    const position = picture?.placeAt(pixel, place.position) ?? this.besideSurface(pixel, pair);
    if (position) model.pairs.movePlace(pair.number, side, { position, timeS });
  }
}
