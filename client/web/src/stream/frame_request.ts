// What frame is asked for, and how a GET asks for it.
import { ApiError } from '../api/errors.ts';
import { idOf, send, withQuery, type Query } from '../api/http.ts';
import type { EncodedFrame, FrameInfo } from './frame.ts';

/** A family, or an animation as it was imported. */
export interface Subject {
  name: string; // families/{id} or animations/{id}
  version: bigint; // of a family; 0: the published one
}

/** Weights, or a point in parameter space instead. */
export interface Blend {
  weights: number[];
  parameters?: { name: string; value: number }[];
  extrapolate?: boolean;
}

export interface FrameRequest {
  subject: Subject;
  blend: Blend;
  timeS: number;
  levelOfDetail: number;
  restPositions?: boolean; // of a family
}

export type FileFormat = 'drc' | 'ply' | 'obj';

export function isFamily(subject: Subject): boolean {
  return subject.name.startsWith('families/');
}

/** The path of a frame as a file. Levels and weights that are 0 are left out. */
export function framePath(request: FrameRequest, format: FileFormat, query: Query = {}): string {
  const { subject } = request;
  const fields = isFamily(subject) ? familyFields(request) : animationFields(request);
  const collection = isFamily(subject) ? 'families' : 'animations';
  return withQuery(`/v1/${collection}/${idOf(subject.name)}/frame.${format}`, {
    ...fields,
    ...query,
  });
}

function familyFields(request: FrameRequest): Query {
  const { subject, blend, timeS, levelOfDetail, restPositions } = request;
  return {
    weights: blend.parameters ? undefined : blend.weights.join(','),
    parameters: blend.parameters?.map(({ name, value }) => `${name}=${value}`).join(','),
    extrapolate: blend.parameters && blend.extrapolate ? true : undefined,
    time: timeS,
    level_of_detail: levelOfDetail || undefined,
    attributes: restPositions ? 'rest_positions' : undefined,
    version: subject.version ? String(subject.version) : undefined,
  };
}

function animationFields({ timeS, levelOfDetail }: FrameRequest): Query {
  return { timeS, levelOfDetail: levelOfDetail || undefined };
}

/** Errors: ApiError, or AbortError if the signal ended it. */
export async function fetchFrame(
  request: FrameRequest,
  signal: AbortSignal,
): Promise<EncodedFrame> {
  const response = await send(framePath(request, 'drc'), { signal });
  const data = new Uint8Array(await response.arrayBuffer());
  if (!data.length) throw new ApiError(response.status, 'The server sent an empty frame.');
  return { info: infoOf(response.headers, request.levelOfDetail), data };
}

function infoOf(headers: Headers, levelOfDetail: number): FrameInfo {
  const numbers = (name: string) =>
    (headers.get(`X-Liquidblend-${name}`) ?? '').split(',').filter(Boolean).map(Number);
  return {
    version: numbers('Version')[0] ?? 0,
    timeS: numbers('Time')[0] ?? 0,
    frameNumber: numbers('Frame-Number')[0],
    weights: numbers('Weights'),
    levelOfDetail,
    extrapolated: headers.has('X-Liquidblend-Extrapolated'),
    clamped: headers.has('X-Liquidblend-Clamped'),
    numDropped: 0,
  };
}
