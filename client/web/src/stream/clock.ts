// Times of an animation while it plays.
import { clamp, roundTo } from '../base/numbers.ts';

export type Loop = 'off' | 'whole' | 'range';

/** Where playing begins, ends and goes on. */
export interface Course {
  rate: number; // seconds of the animation per second; negative: backwards
  loop: Loop;
  range: [number, number];
  durationS: number;
}

export interface Step {
  timeS: number;
  ended: boolean;
}

const timeDecimals = 4;

/** A time with as few digits as the URL has, and never beyond the end, which the server refuses. */
export function shortTime(timeS: number, durationS: number): number {
  return Math.min(roundTo(clamp(timeS, 0, durationS), timeDecimals), durationS);
}

/** The part of the animation that is played. */
export function playedRange({ loop, range, durationS }: Course): [number, number] {
  if (loop !== 'range') return [0, durationS];
  const low = clamp(Math.min(...range), 0, durationS);
  const high = clamp(Math.max(...range), 0, durationS);
  return high > low ? [low, high] : [0, durationS];
}

/** Where playing is after `elapsedS` of the clock. */
export function advance(timeS: number, elapsedS: number, course: Course): Step {
  const [low, high] = playedRange(course);
  const next = timeS + elapsedS * course.rate;
  if (next >= low && next <= high) return { timeS: next, ended: false };
  if (course.loop === 'off') return { timeS: clamp(next, low, high), ended: true };
  return { timeS: wrap(next, low, high), ended: false };
}

function wrap(timeS: number, low: number, high: number): number {
  const length = high - low;
  if (!(length > 0)) return low;
  const beyond = (timeS - low) % length;
  return low + (beyond < 0 ? beyond + length : beyond);
}

// Times in the URL are rounded, so the end may be missed by a little.
const nearS = 1e-3;

/** Where playing begins: from the other end if it would end at once. */
export function startTime(timeS: number, course: Course): number {
  const [low, high] = playedRange(course);
  const inside = clamp(timeS, low, high);
  if (course.rate > 0 && inside >= high - nearS) return low;
  if (course.rate < 0 && inside <= low + nearS) return high;
  return inside;
}
