// What the server says about a family or an animation before its first frame.
import type { Box3, Matrix4 } from 'three';
import { getAnimation, getFamily } from '../api/resources.ts';
import type { Animation, Bounds, Family } from '../generated/liquidblend/v1/liquidblend_pb.ts';
import { sceneBox, sceneRotation } from '../scene/up.ts';
import type { Subject } from '../stream/frame_request.ts';
import type { Timing } from '../stream/player.ts';

export interface SubjectInfo {
  subject: Subject;
  timing: Timing;
  box: Box3;
  rotation: Matrix4;
  family?: Family;
  animation?: Animation;
}

function durationOf({ numFrames, framesPerSecond }: Animation): number {
  return Math.max(0, numFrames - 1) / framesPerSecond;
}

function animationInfo(animation: Animation): SubjectInfo {
  const { name, framesPerSecond, bounds, up } = animation;
  return {
    subject: { name, version: 0n },
    timing: { durationS: durationOf(animation), framesPerSecond, numLevels: 1 },
    box: sceneBox(bounds ? [bounds] : [], up),
    rotation: sceneRotation(up),
    animation,
  };
}

function familyInfo(family: Family, version: bigint, inputs: Bounds[]): SubjectInfo {
  const { name, durationS, framesPerSecond, bounds, up, coarserLevels } = family;
  const around = inputs.length ? inputs : bounds ? [bounds] : [];
  return {
    subject: { name, version },
    timing: { durationS, framesPerSecond, numLevels: 1 + coarserLevels.length },
    box: sceneBox(around, up),
    rotation: sceneRotation(up),
    family,
  };
}

// The bounds of a family leave room around its animations; theirs say where the ground is.
async function inputBounds(family: Family, signal: AbortSignal): Promise<Bounds[]> {
  const names = [family.source, ...family.targets];
  const found = await Promise.allSettled(names.map((name) => getAnimation(name, signal)));
  return found.flatMap((result) =>
    result.status === 'fulfilled' && result.value.bounds ? [result.value.bounds] : [],
  );
}

/** Errors: ApiError, or AbortError if the signal ended it. */
export async function loadSubject(
  name: string,
  version: bigint,
  signal: AbortSignal,
): Promise<SubjectInfo> {
  if (name.startsWith('animations/')) return animationInfo(await getAnimation(name, signal));
  const family = await getFamily(name, version, signal);
  return familyInfo(family, version, await inputBounds(family, signal));
}
