// Places of pairs, for tests.
import type { SpaceTime } from '../src/pairs/pairs.ts';

export function place(x: number, timeS = 0): SpaceTime {
  return { position: [x, 0.5, -1], timeS };
}
