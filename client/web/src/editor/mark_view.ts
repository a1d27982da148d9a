// How markers, paths and the times of pairs are drawn.
import { nothing, svg } from 'lit';
import type { Pair, Side } from '../pairs/pairs.ts';
import type { Camera } from './camera.ts';
import { colourOf } from './colours.ts';
import type { Mark } from './marks.ts';
import type { Path } from './path.ts';

/** What happens to a marker. */
export interface MarkEvents {
  down(event: PointerEvent, mark: Mark): void;
  move(event: PointerEvent): void;
  up(event: PointerEvent, mark: Mark): void;
  /** The browser has taken the pointer, for a gesture say. */
  cancel(): void;
  key(event: KeyboardEvent, mark: Mark): void;
  focus(mark: Mark): void;
}

function classesOf({ pair, number }: Mark, chosen: boolean): string {
  const states = { selected: chosen, off: !pair.enabled, check: pair.check, automatic: !number };
  const names = Object.entries(states).filter(([, on]) => on);
  return ['mark', ...names.map(([name]) => name)].join(' ');
}

// Hard: a square. Space: a diamond. Soft points and trajectories: a circle.
function bodyOf({ number, colour, pair: { kind, hard } }: Mark) {
  if (!number) return svg`<circle class="body" fill=${colour} r="5" />`;
  if (kind === 'SPACE')
    return svg`<path class="body" fill=${colour} d="M0 -11L11 0L0 11L-11 0z" />`;
  if (hard)
    return svg`<rect class="body" fill=${colour} x="-9" y="-9" width="18" height="18" rx="2" />`;
  return svg`<circle class="body" fill=${colour} r="9.5" />`;
}

/** The list leads to automatic ones by keys, so that Tab comes to the person's own soon. */
export function renderMark(mark: Mark, chosen: boolean, events: MarkEvents) {
  const { x, y, number } = mark;
  return svg`<g
    class=${classesOf(mark, chosen)}
    transform=${`translate(${x.toFixed(1)} ${y.toFixed(1)})`}
    opacity=${chosen ? 1 : mark.opacity.toFixed(2)}
    tabindex=${number ? 0 : -1}
    role="button"
    aria-pressed=${chosen ? 'true' : 'false'}
    aria-label=${mark.about}
    @pointerdown=${(event: PointerEvent) => events.down(event, mark)}
    @pointermove=${(event: PointerEvent) => events.move(event)}
    @pointerup=${(event: PointerEvent) => events.up(event, mark)}
    @pointercancel=${() => events.cancel()}
    @keydown=${(event: KeyboardEvent) => events.key(event, mark)}
    @focus=${() => events.focus(mark)}
  >
    <circle class="halo" r=${number ? 13 : 9} />
    ${bodyOf(mark)}
    <text x=${number ? 0 : 16} y="0.5">${mark.label}</text>
  </g>`;
}

/** A trajectory: a line, with a dot at each frame. */
export function renderPath(path: Path, number: number, camera: Camera) {
  if (path.length < 2) return nothing;
  const seen = path.map(({ position }) => camera.see(position)).filter(({ depth }) => depth > 0);
  const points = seen.map(({ x, y }) => `${x.toFixed(1)},${y.toFixed(1)}`).join(' ');
  const colour = colourOf(number);
  return svg`<polyline class="path" points=${points} stroke=${colour} />
    ${seen.slice(1).map(({ x, y }) => svg`<circle cx=${x} cy=${y} r="2" fill=${colour} />`)}`;
}

function renderTick(pair: Pair, side: Side, durationS: number) {
  const place = pair[side];
  if (!place) return nothing;
  const share = (timeS: number) => Math.min(100, (100 * timeS) / durationS);
  const x = share(place.timeS);
  const end = pair.lengthS ? share(place.timeS + pair.lengthS) : 100;
  const line = (x1: number, x2: number, y1: number, y2: number) =>
    svg`<line x1=${x1} x2=${x2} y1=${y1} y2=${y2} stroke=${colourOf(pair.number)} stroke-width="2"
      vector-effect="non-scaling-stroke" />`;
  return svg`${line(x, x, 1, 11)} ${pair.kind === 'POINT' ? nothing : line(x, end, 6, 6)}`;
}

/** When each pair is, from left to right. */
export function renderTicks(pairs: readonly Pair[], side: Side, durationS: number) {
  if (!(durationS > 0)) return [];
  return pairs.map((pair) => renderTick(pair, side, durationS));
}
