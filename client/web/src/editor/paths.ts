// Where trajectories go: a place is carried by the velocities of the frames, as the registration
// does it, and kept on the surface.
import { isAbort } from '../api/errors.ts';
import { send } from '../api/http.ts';
import { distanceBetween, type SpaceTime, type Vector } from '../pairs/pairs.ts';
import { sharedPool, type DecodeResult } from '../stream/decoder_pool.ts';
import { framePath } from '../stream/frame_request.ts';
import type { SubjectInfo } from '../view/subject.ts';
import { plus } from './camera.ts';
import { nearestVertex, vectorAt, type Path } from './path.ts';

const maxFrames = 120;
const lostEdges = 5;  // further from the surface it is no feature of it any more

async function fetchDecoded(
  info: SubjectInfo,
  timeS: number,
  signal: AbortSignal,
): Promise<DecodeResult> {
  const { subject } = info;
  const request = { subject, blend: { weights: [] }, timeS, levelOfDetail: 0 };
  const path = framePath(request, 'drc', { attributes: 'VELOCITIES' });
  const response = await send(path, { signal });
  const data = new Uint8Array(await response.arrayBuffer());
  const wanted = { normals: false, velocities: true, restPositions: false, edges: false };
  return sharedPool().decode(data, wanted);
}

interface Carried {
  here: Vector;  // on the surface
  next: Vector;  // a frame later
}

// undefined: the surface is not there any more, or has no velocities.
function carry(
  { counts, buffers }: DecodeResult,
  at: Vector,
  frameS: number,
  lostM: number,
): Carried | undefined {
  const vertex = nearestVertex(buffers.positions, counts.vertices, at);
  if (vertex < 0 || !counts.hasVelocities) return undefined;
  const here = vectorAt(buffers.positions, vertex);
  if (distanceBetween(here, at) > lostM) return undefined;
  return { here, next: plus(here, vectorAt(buffers.velocities, vertex), frameS) };
}

/** Follows a place for a while (0: to the end). Errors: ApiError, AbortError. */
export async function followPlace(
  info: SubjectInfo,
  start: SpaceTime,
  lengthS: number,
  signal: AbortSignal,
): Promise<Path> {
  const { framesPerSecond, durationS } = info.timing;
  const frameS = 1 / framesPerSecond;
  const end = Math.min(durationS, lengthS ? start.timeS + lengthS : durationS) + frameS / 2;
  const lostM = lostEdges * (info.animation?.meanEdgeLengthM ?? Number.POSITIVE_INFINITY);
  const path: Path = [];
  let at = start.position;
  for (let timeS = start.timeS; timeS <= end && path.length < maxFrames; timeS += frameS) {
    const decoded = await fetchDecoded(info, Math.min(timeS, durationS), signal);
    const carried = carry(decoded, at, frameS, lostM);
    sharedPool().release(decoded.buffers);
    if (!carried) break;
    path.push({ position: path.length ? carried.here : start.position, timeS });
    at = carried.next;
  }
  return path;
}

interface Entry {
  path: Path;
  controller: AbortController | undefined;  // while it is followed
}

/** Paths that were followed, by what they begin with. */
export class Paths {
  private readonly entries = new Map<string, Entry>();

  constructor(private readonly changed: () => void) {}

  /** What is known by now; begins to follow it. */
  get(info: SubjectInfo, start: SpaceTime, lengthS: number): Path {
    const key = JSON.stringify([info.subject.name, start, lengthS]);
    const known = this.entries.get(key);
    if (known) return known.path;
    const entry: Entry = { path: [], controller: new AbortController() };
    this.entries.set(key, entry);
    void this.follow(key, entry, info, start, lengthS);
    return entry.path;
  }

  /** Ends what is followed. */
  close(): void {
    for (const { controller } of this.entries.values()) controller?.abort();
    this.entries.clear();
  }

  private async follow(
    key: string,
    entry: Entry,
    info: SubjectInfo,
    start: SpaceTime,
    lengthS: number,
  ): Promise<void> {
    try {
      entry.path = await followPlace(info, start, lengthS, entry.controller!.signal);
    } catch (error) {
      if (isAbort(error)) this.entries.delete(key);
    }
    entry.controller = undefined;
    this.changed();
  }
}
