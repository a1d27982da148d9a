// Where a ray meets a surface.
import { distanceBetween, type Vector } from '../pairs/pairs.ts';
import { plus, type Ray } from './camera.ts';

/** The surface of a frame; the arrays may be longer. */
export interface Triangles {
  positions: ArrayLike<number>;
  indices: ArrayLike<number>;
  count: number;  // of indices
}

/** Distances along the ray at which it enters or leaves the surface, in no order. */
export function castRay(ray: Ray, { positions, indices, count }: Triangles): number[] {
  const { origin, direction } = ray;
  const [ox, oy, oz] = origin;
  const [dx, dy, dz] = direction;
  const hits: number[] = [];
  for (let i = 0; i < count; i += 3) {
    const a = 3 * indices[i]!;
    const b = 3 * indices[i + 1]!;
    const c = 3 * indices[i + 2]!;
    const ax = positions[a]!, ay = positions[a + 1]!, az = positions[a + 2]!;
    const ux = positions[b]! - ax, uy = positions[b + 1]! - ay, uz = positions[b + 2]! - az;
    const vx = positions[c]! - ax, vy = positions[c + 1]! - ay, vz = positions[c + 2]! - az;
    const px = dy * vz - dz * vy, py = dz * vx - dx * vz, pz = dx * vy - dy * vx;
    const determinant = ux * px + uy * py + uz * pz;
    if (determinant > -1e-14 && determinant < 1e-14) continue;
    const inverse = 1 / determinant;
    const tx = ox - ax, ty = oy - ay, tz = oz - az;
    const u = (tx * px + ty * py + tz * pz) * inverse;
    if (u < 0 || u > 1) continue;
    const qx = ty * uz - tz * uy, qy = tz * ux - tx * uz, qz = tx * uy - ty * ux;
    const v = (dx * qx + dy * qy + dz * qz) * inverse;
    if (v < 0 || u + v > 1) continue;
    const distance = (vx * qx + vy * qy + vz * qz) * inverse;
    if (distance > 0) hits.push(distance);
  }
  return hits;
}

function at({ origin, direction }: Ray, distance: number): Vector {
  return plus(origin, direction, distance);
}

/** The first place that the ray meets; undefined if it meets none. */
export function firstHit(ray: Ray, surface: Triangles): Vector | undefined {
  const hits = castRay(ray, surface);
  return hits.length ? at(ray, Math.min(...hits)) : undefined;
}

/** The place that the ray meets nearest to another one. */
export function hitNearest(ray: Ray, surface: Triangles, to: Vector): Vector | undefined {
  const places = castRay(ray, surface).map((distance) => at(ray, distance));
  return places.reduce<Vector | undefined>(
    (best, place) =>
      !best || distanceBetween(place, to) < distanceBetween(best, to) ? place : best,
    undefined,
  );
}

/** The place of the ray that is as deep as another one. */
export function atDepthOf(ray: Ray, place: Vector): Vector {
  return at(ray, distanceBetween(ray.origin, place));
}
