// Places that follow one another in time.
import type { SpaceTime, Vector } from '../pairs/pairs.ts';
import { plus } from './camera.ts';

/** Places at one frame after the other. */
export type Path = SpaceTime[];

/** The vertex nearest to a place. */
export function nearestVertex(
  positions: ArrayLike<number>,
  count: number,
  [x, y, z]: Vector,
): number {
  let best = -1;
  let least = Number.POSITIVE_INFINITY;
  for (let i = 0; i < count; ++i) {
    const dx = positions[3 * i]! - x;
    const dy = positions[3 * i + 1]! - y;
    const dz = positions[3 * i + 2]! - z;
    const square = dx * dx + dy * dy + dz * dz;
    if (square < least) {
      least = square;
      best = i;
    }
  }
  return best;
}

export function vectorAt(values: ArrayLike<number>, index: number): Vector {
  return [values[3 * index]!, values[3 * index + 1]!, values[3 * index + 2]!];
}

/** Where a path is at a time; its begin before, its end after. */
export function placeAt(path: Path, start: SpaceTime, timeS: number): Vector {
  const first = path[0];
  if (!first || timeS <= first.timeS) return start.position;
  const next = path.findIndex((place) => place.timeS >= timeS);
  if (next < 0) return path.at(-1)!.position;
  const [a, b] = [path[next - 1]!, path[next]!];
  const share = (timeS - a.timeS) / (b.timeS - a.timeS || 1);
  return plus(a.position, plus(b.position, a.position, -1), share);
}
