// Markers of a pane: what stands where in the picture.
import type { AutomaticPair } from '../pairs/correspondences.ts';
import { timeDistance, type Pair, type Side, type SpaceTime } from '../pairs/pairs.ts';
import type { Camera, Pixel } from './camera.ts';
import { automaticColour, colourOf } from './colours.ts';

/** A marker of the user's pair or of an automatic one. */
export interface Mark extends Pixel {
  id: string;
  number: number;  // 0: automatic
  key: string;  // of an automatic one
  label: string;
  about: string;  // for those who cannot see it
  colour: string;
  opacity: number;
  pair: Omit<Pair, 'number'>;
}

const fadeS = 0.5;
const faintest = 0.22;

/** 1 at the time of the cursor, fainter before and after. */
export function opacityAt(distanceS: number): number {
  return Math.max(faintest, 1 - (1 - faintest) * Math.min(1, distanceS / fadeS));
}

function wordsOf({ kind, hard, check, enabled }: Omit<Pair, 'number'>): string {
  const sort = check ? 'check ' : '';
  return `${hard ? 'hard' : 'soft'} ${sort}${kind.toLowerCase()}${enabled ? '' : ', switched off'}`;
}

/** Markers of the user's pairs. `placeOf`: where a trajectory is at the cursor's time. */
export function ownMarks(
  pairs: readonly Pair[],
  side: Side,
  timeS: number,
  camera: Camera,
  placeOf: (pair: Pair, place: SpaceTime) => SpaceTime['position'],
): Mark[] {
  return pairs.flatMap((pair) => {
    const place = pair[side];
    if (!place) return [];
    const seen = camera.see(placeOf(pair, place));
    if (seen.depth <= 0) return [];
    const { number } = pair;
    return {
      ...seen,
      id: `${side}-${number}`,
      number,
      key: '',
      label: String(number),
      about: `Pair ${number}, ${side}, ${wordsOf(pair)}, at ${place.timeS.toFixed(2)} s`,
      colour: colourOf(number),
      opacity: opacityAt(timeDistance(pair, place, timeS)),
      pair,
    };
  });
}

export function automaticMarks(
  found: readonly AutomaticPair[],
  dropped: readonly string[],
  side: Side,
  timeS: number,
  camera: Camera,
): Mark[] {
  return found.flatMap(({ key, pair, confidence }, index) => {
    const place = pair[side];
    const seen = camera.see(place.position);
    if (seen.depth <= 0 || dropped.includes(key)) return [];
    return {
      ...seen,
      id: `${side}-automatic-${index}`,
      number: 0,
      key,
      label: `A${index + 1}`,
      about: `Automatic pair ${index + 1}, ${side}, confidence ${confidence.toFixed(2)}`,
      colour: automaticColour,
      opacity: opacityAt(timeDistance({ ...pair, number: 0 }, place, timeS)),
      pair,
    };
  });
}
