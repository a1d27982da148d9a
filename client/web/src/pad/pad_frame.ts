// Between parts of the parameters' ranges and places in the pad's picture.
import { clamp } from '../base/numbers.ts';

export const padWidth = 236;
export const padHeight = 208;

/** The two parameters that the picture shows; the same one twice: a line. */
export type Axes = [number, number];

export interface Place {
  x: number;
  y: number;
}

const markerRadius = 11;
const marginX = 44;
const marginTop = 40;
const marginBottom = 44;

export function isLine([x, y]: Axes): boolean {
  return x === y;
}

/** Where a scaled point is in the picture. */
export function placeOf(scaled: number[], axes: Axes): Place {
  const x = marginX + scaled[axes[0]]! * (padWidth - 2 * marginX);
  const bottom = padHeight - marginBottom;
  const y = isLine(axes) ? padHeight / 2 : bottom - scaled[axes[1]]! * (bottom - marginTop);
  return { x, y };
}

/** The nearest place where a marker is seen whole: a point may be far outside. */
export function seenPlace({ x, y }: Place): Place {
  return {
    x: clamp(x, markerRadius, padWidth - markerRadius),
    y: clamp(y, markerRadius, padHeight - markerRadius),
  };
}

/** The scaled point at a place; parameters that the picture does not show stay as they are. */
export function scaledAt({ x, y }: Place, axes: Axes, before: number[]): number[] {
  const scaled = [...before];
  const bottom = padHeight - marginBottom;
  if (!isLine(axes)) scaled[axes[1]] = (bottom - y) / (bottom - marginTop);
  scaled[axes[0]] = (x - marginX) / (padWidth - 2 * marginX);
  return scaled;
}
