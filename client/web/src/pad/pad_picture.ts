// What the pad draws behind its marker: simplices, points and the names of the axes.
import { svg } from 'lit';
import { isLine, padHeight, padWidth, placeOf, type Axes, type Place } from './pad_frame.ts';
import { edgesOf, type Edge, type PointSpace } from './space.ts';

const longestLabel = 16;

function placesOf(space: PointSpace, axes: Axes): Place[] {
  return space.points.map((point) => placeOf(space.scale(point), axes));
}

export function renderSimplices(space: PointSpace, axes: Axes) {
  const places = placesOf(space, axes);
  const { inner, hull } = edgesOf(space.simplices);
  const corners = (simplex: number[]) =>
    simplex.map((index) => `${places[index]!.x},${places[index]!.y}`).join(' ');
  const line =
    (kind: string) =>
    ([a, b]: Edge) => {
      const [from, to] = [places[a]!, places[b]!];
      return svg`<line class=${kind} x1=${from.x} y1=${from.y} x2=${to.x} y2=${to.y} />`;
    };
  return svg`
    ${space.simplices.map((simplex) => svg`<polygon class="area" points=${corners(simplex)} />`)}
    ${inner.map(line('inner'))} ${hull.map(line('hull'))}`;
}

export function renderPoints(space: PointSpace, labels: string[], axes: Axes) {
  return placesOf(space, axes).map(
    (place, i) => svg`<circle class="point" cx=${place.x} cy=${place.y} r="4" />
      ${renderLabel(labels[i]!, place)}`,
  );
}

// Inside of the picture, whatever its length.
function renderLabel(label: string, { x, y }: Place) {
  const text = label.length > longestLabel ? `${label.slice(0, longestLabel - 1)}…` : label;
  const anchor = x < padWidth * 0.3 ? 'start' : x > padWidth * 0.7 ? 'end' : 'middle';
  const shift = { start: -20, middle: 0, end: 20 }[anchor];
  const left = Math.min(padWidth - 4, Math.max(4, x + shift));
  const top = y < padHeight / 2 ? y - 9 : y + 17;
  return svg`<text class="label" x=${left} y=${top} text-anchor=${anchor}>${text}</text>`;
}

export function renderNames(names: string[], axes: Axes) {
  const right = svg`<text class="name" x=${padWidth - 6} y=${padHeight - 6}
    text-anchor="end">${names[axes[0]]} →</text>`;
  return isLine(axes)
    ? right
    : svg`${right}<text class="name" x="6" y="14">↑ ${names[axes[1]]}</text>`;
}
