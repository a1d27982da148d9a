// Mouse, touch, wheel and keys move the camera.
import { panned, turned, zoomed, type Orbit } from './orbit.ts';

export interface OrbitTarget {
  readonly orbit: Orbit;
  readonly radius: number;
  move(orbit: Orbit): void;
  reset(): void;
}

const degreesPerPixel = 0.35;
const keyDegrees = 5;
const keyPan = 0.04;
const keyZoom = 1.12;

interface Point {
  x: number;
  y: number;
}

/** Follows an element. One pointer turns (or pans), two pan and zoom. */
export class OrbitInput {
  private readonly pointers = new Map<number, Point>();

  constructor(
    private readonly element: HTMLElement,
    private readonly target: OrbitTarget,
  ) {
    const on = <K extends keyof HTMLElementEventMap>(
      type: K,
      listener: (event: HTMLElementEventMap[K]) => void,
    ) => element.addEventListener(type, listener, { passive: false });
    on('pointerdown', (event) => this.begin(event));
    on('pointermove', (event) => this.drag(event));
    on('pointerup', (event) => this.pointers.delete(event.pointerId));
    on('pointercancel', (event) => this.pointers.delete(event.pointerId));
    on('wheel', (event) => this.wheel(event));
    on('keydown', (event) => this.key(event));
    on('dblclick', () => this.target.reset());
    on('contextmenu', (event) => event.preventDefault());
  }

  private begin(event: PointerEvent): void {
    this.element.setPointerCapture(event.pointerId);
    this.pointers.set(event.pointerId, { x: event.clientX, y: event.clientY });
  }

  private drag(event: PointerEvent): void {
    const before = this.pointers.get(event.pointerId);
    if (!before) return;
    const now = { x: event.clientX, y: event.clientY };
    const other = [...this.pointers].find(([id]) => id !== event.pointerId)?.[1];
    this.pointers.set(event.pointerId, now);
    const pans = event.shiftKey || event.ctrlKey || event.metaKey || (event.buttons & 6) !== 0;
    if (other) this.pinch(before, now, other);
    else if (pans) this.pan(now.x - before.x, now.y - before.y);
    else this.turn(now.x - before.x, now.y - before.y);
  }

  private turn(x: number, y: number): void {
    this.target.move(turned(this.target.orbit, -x * degreesPerPixel, y * degreesPerPixel));
  }

  private pan(x: number, y: number): void {
    const height = this.element.clientHeight || 1;
    this.target.move(panned(this.target.orbit, -x / height, y / height));
  }

  private pinch(before: Point, now: Point, other: Point): void {
    const apart = (point: Point) => Math.hypot(point.x - other.x, point.y - other.y) || 1;
    this.target.move(zoomed(this.target.orbit, apart(before) / apart(now), this.target.radius));
    this.pan((now.x - before.x) / 2, (now.y - before.y) / 2);
  }

  private wheel(event: WheelEvent): void {
    event.preventDefault();
    const lines = event.deltaMode === WheelEvent.DOM_DELTA_LINE ? 16 : 1;
    const factor = Math.exp(Math.max(-1, Math.min(1, event.deltaY * lines * 0.0015)));
    this.target.move(zoomed(this.target.orbit, factor, this.target.radius));
  }

  private key(event: KeyboardEvent): void {
    if (event.ctrlKey || event.metaKey || event.altKey) return;
    const next = this.afterKey(event.key, event.shiftKey);
    if (!next) return;
    event.preventDefault();
    event.stopPropagation();
    this.target.move(next);
  }

  private afterKey(key: string, shift: boolean): Orbit | undefined {
    const { orbit, radius } = this.target;
    const way = arrows[key];
    if (way) {
      const [x, y] = way;
      if (shift) return panned(orbit, x * keyPan, y * keyPan);
      return turned(orbit, x * keyDegrees, y * keyDegrees);
    }
    if (key === '+' || key === '=') return zoomed(orbit, 1 / keyZoom, radius);
    if (key === '-' || key === '_') return zoomed(orbit, keyZoom, radius);
    return undefined;
  }
}

const arrows: Record<string, [number, number]> = {
  ArrowLeft: [-1, 0],
  ArrowRight: [1, 0],
  ArrowUp: [0, 1],
  ArrowDown: [0, -1],
};
