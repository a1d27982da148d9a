// Points of a parameter space and weights: barycentric coordinates in the server's simplices.
import { clamp } from '../base/numbers.ts';

export type Point = number[];

/** Where a point lies. */
export interface Location {
  weights: number[];  // one per target, of the nearest simplex; beyond [0, 1] outside of the hull
  isOutside: boolean;
  nearest: Point;  // of the hull, in the user's units
  nearestWeights: number[];
  distance: number;  // to it, in parts of the parameters' ranges
}

const tolerance = 1e-6;  // points this close to the hull are on it
const rounding = 1e-12;
const sameFace = 1e-9;
const steps = 2 ** 30;  // weights are multiples of 1 / steps, as the server's

interface Nearest {
  simplex: number[];
  point: Point;
  distance: number;
  squares: number;
}

/** Solves a small system by elimination; undefined if it has no single solution. */
export function solve(matrix: number[][], right: number[]): number[] | undefined {
  const rows = matrix.map((row, i) => [...row, right[i]!]);
  const n = rows.length;
  for (let column = 0; column < n; ++column) {
    const best = pivotRow(rows, column);
    if (Math.abs(rows[best]![column]!) < 1e-14) return undefined;
    [rows[column], rows[best]] = [rows[best]!, rows[column]!];
    for (let row = 0; row < n; ++row) if (row !== column) eliminate(rows, row, column);
  }
  return rows.map((row, i) => row[n]! / row[i]!);
}

function pivotRow(rows: number[][], column: number): number {
  let best = column;
  for (let row = column + 1; row < rows.length; ++row) {
    if (Math.abs(rows[row]![column]!) > Math.abs(rows[best]![column]!)) best = row;
  }
  return best;
}

function eliminate(rows: number[][], row: number, column: number): void {
  const factor = rows[row]![column]! / rows[column]![column]!;
  if (!factor) return;
  for (let i = column; i <= rows.length; ++i) rows[row]![i]! -= factor * rows[column]![i]!;
}

function dot(a: Point, b: Point): number {
  return a.reduce((total, value, i) => total + value * b[i]!, 0);
}

function minus(a: Point, b: Point): Point {
  return a.map((value, i) => value - b[i]!);
}

function distanceOf(a: Point, b: Point): number {
  return Math.hypot(...minus(a, b));
}

/** Barycentric coordinates. Requires: as many corners as dimensions and one, not flat. */
export function coordinatesIn(corners: Point[], point: Point): number[] {
  const matrix = point.map((_, row) => corners.map((corner) => corner[row]!));
  const all = solve([...matrix, corners.map(() => 1)], [...point, 1]);
  return all ?? corners.map(() => Number.NaN);
}

function combine(corners: Point[], coordinates: number[]): Point {
  return corners[0]!.map((_, i) =>
    dot(
      corners.map((corner) => corner[i]!),
      coordinates,
    ),
  );
}

// Coordinates of the projection to the space that the corners span.
function projected(corners: Point[], point: Point): number[] {
  const edges = corners.slice(1).map((corner) => minus(corner, corners[0]!));
  const offset = minus(point, corners[0]!);
  const gram = edges.map((a) => edges.map((b) => dot(a, b)));
  const inner =
    solve(
      gram,
      edges.map((edge) => dot(edge, offset)),
    ) ?? edges.map(() => 0);
  return [1 - inner.reduce((total, value) => total + value, 0), ...inner];
}

/** The point of a simplex, of any number of corners, that is closest to another one. */
export function closestIn(corners: Point[], point: Point): Point {
  if (corners.length === 1) return corners[0]!;
  const inner = projected(corners, point);
  if (Math.min(...inner) >= 0) return combine(corners, inner);
  const sides = inner.flatMap((value, i) => (value < 0 ? [corners.filter((_, k) => k !== i)] : []));
  const candidates = sides.map((side) => closestIn(side, point));
  return candidates.reduce((best, candidate) =>
    distanceOf(candidate, point) < distanceOf(best, point) ? candidate : best,
  );
}

export class PointSpace {
  private readonly low: Point;
  private readonly range: Point;
  private readonly scaled: Point[];

  /** `simplices`: indices into points, of which the first one is the source's. */
  constructor(
    readonly names: string[],
    readonly points: Point[],
    readonly simplices: number[][],
  ) {
    this.low = names.map((_, i) => Math.min(...points.map((point) => point[i]!)));
    const high = names.map((_, i) => Math.max(...points.map((point) => point[i]!)));
    this.range = high.map((value, i) => value - this.low[i]! || 1);
    this.scaled = points.map((point) => this.scale(point));
  }

  /** In parts of the parameters' ranges: from 0 to 1 over the family's animations. */
  scale(point: Point): Point {
    return point.map((value, i) => (value - this.low[i]!) / this.range[i]!);
  }

  unscale(point: Point): Point {
    return point.map((value, i) => this.low[i]! + value * this.range[i]!);
  }

  /** undefined if the server gave no simplices. */
  locate(point: Point): Location | undefined {
    if (!this.simplices.length) return undefined;
    const scaled = this.scale(point);
    const around = this.simplices.find((simplex) => this.isIn(simplex, scaled, rounding));
    if (around) return this.inside(around, point, scaled);
    const { simplex, point: closest, distance } = this.findNearest(scaled);
    return {
      weights: this.weights(simplex, scaled),
      isOutside: distance > tolerance,
      nearest: this.unscale(closest),
      nearestWeights: this.weights(simplex, closest).map((weight) => clamp(weight, 0, 1)),
      distance,
    };
  }

  private inside(simplex: number[], point: Point, scaled: Point): Location {
    const weights = this.weights(simplex, scaled);
    return { weights, isOutside: false, nearest: point, nearestWeights: weights, distance: 0 };
  }

  private corners(simplex: number[]): Point[] {
    return simplex.map((index) => this.scaled[index]!);
  }

  private isIn(simplex: number[], scaled: Point, slack: number): boolean {
    return Math.min(...coordinatesIn(this.corners(simplex), scaled)) >= -slack;
  }

  private weights(simplex: number[], scaled: Point): number[] {
    const weights = this.points.map(() => 0);
    coordinatesIn(this.corners(simplex), scaled).forEach((value, i) => {
      weights[simplex[i]!] = Math.round(value * steps) / steps;
    });
    return weights.slice(1);
  }

  // Nearest simplex; of equally near ones, that with the smallest sum of squared weights.
  private findNearest(scaled: Point): Nearest {
    const all = this.simplices.map((simplex) => this.nearestIn(simplex, scaled));
    const closest = all.reduce((best, one) =>
      one.distance < best.distance - rounding ? one : best,
    );
    const asNear = all.filter(({ simplex }) => this.isIn(simplex, closest.point, sameFace));
    const best = asNear.reduce((a, b) => (b.squares < a.squares ? b : a), closest);
    return { ...closest, simplex: best.simplex };
  }

  private nearestIn(simplex: number[], scaled: Point): Nearest {
    const corners = this.corners(simplex);
    const point = closestIn(corners, scaled);
    const coordinates = coordinatesIn(corners, scaled);
    return {
      simplex,
      point,
      distance: distanceOf(point, scaled),
      squares: dot(coordinates, coordinates),
    };
  }
}

export type Edge = [number, number];

interface Edges {
  inner: Edge[];
  hull: Edge[];  // of one triangle only, or of intervals all
}

/** The edges of all simplices; those of the hull apart where the simplices are triangles. */
export function edgesOf(simplices: number[][]): Edges {
  const counts = new Map<string, { edge: Edge; count: number }>();
  for (const simplex of simplices) {
    simplex.forEach((a, i) => {
      for (const b of simplex.slice(i + 1)) {
        const key = `${Math.min(a, b)} ${Math.max(a, b)}`;
        const known = counts.get(key);
        if (known) ++known.count;
        else counts.set(key, { edge: [a, b], count: 1 });
      }
    });
  }
  const isOfHull = (count: number) => (simplices[0]?.length ?? 0) <= 3 && count === 1;
  const all = [...counts.values()];
  return {
    inner: all.filter(({ count }) => !isOfHull(count)).map(({ edge }) => edge),
    hull: all.filter(({ count }) => isOfHull(count)).map(({ edge }) => edge),
  };
}
