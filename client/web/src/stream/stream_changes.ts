// What a stream is asked for, from the settings of its player.
import { SurfaceOptions_Attribute } from '../generated/liquidblend/v1/liquidblend_pb.ts';
import type { Blend } from './frame_request.ts';
import type { StreamRequest } from './frame_stream.ts';
import type { PlayerSettings } from './player.ts';

export function blendOf({ weights, parameters, extrapolate }: Blend): StreamRequest {
  return parameters
    ? { parameters, extrapolate: !!extrapolate, weights: [] }
    : { weights, parameters: [] };
}

export function paceOf({ framesPerSecond }: PlayerSettings): StreamRequest {
  return framesPerSecond ? { framesPerSecond } : {};
}

export function surfaceOf({ level, wanted }: PlayerSettings, coarseness: number): StreamRequest {
  const attributes = wanted.restPositions ? [SurfaceOptions_Attribute.REST_POSITIONS] : [];
  return {
    surface: { levelOfDetail: level === 'auto' ? coarseness : level, attributes },
    adaptLevelOfDetail: level === 'auto',
  };
}

/**
 * What of the settings changed, as a message; undefined if nothing that the server must know.
 * `ownRate`: frames a second of the family.
 */
export function streamChange(
  before: PlayerSettings,
  after: PlayerSettings,
  coarseness: number,
  ownRate: number,
): StreamRequest | undefined {
  const change: StreamRequest = {};
  if (before.rate !== after.rate) change.rate = after.rate;
  if (before.loop !== after.loop) change.loop = after.loop !== 'off';
  if (before.framesPerSecond !== after.framesPerSecond)
    change.framesPerSecond = after.framesPerSecond || ownRate;
  const surface = surfaceOf(after, coarseness);
  if (JSON.stringify(surface) !== JSON.stringify(surfaceOf(before, coarseness)))
    Object.assign(change, surface);
  if (!sameBlend(before.blend, after.blend)) Object.assign(change, blendOf(after.blend));
  return Object.keys(change).length ? change : undefined;
}

function sameBlend(before: Blend, after: Blend): boolean {
  return JSON.stringify(before) === JSON.stringify(after);
}
