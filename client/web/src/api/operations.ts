// Long work of the server: google.longrunning operations as the page shows them.
import { anyUnpack, timestampMs, type Any } from '@bufbuild/protobuf/wkt';
import {
  ListOperationsResponseSchema,
  OperationSchema,
  type Operation,
} from '../generated/google/longrunning/operations_pb.ts';
import {
  ImportAnimationMetadataSchema,
  RegisterFamilyMetadataSchema,
  Verdict_Grade,
  type Progress,
} from '../generated/liquidblend/v1/liquidblend_pb.ts';
import { ApiError, errorFromJson, isAbort, toApiError } from './errors.ts';
import { getJson, idOf, postJson, remove, send } from './http.ts';
import { fromServer } from './messages.ts';
import type { Page } from './resources.ts';
import { readLines } from './watch_lines.ts';

export type JobKind = 'import' | 'registration' | 'job';
export type JobState = 'running' | 'done' | 'failed' | 'cancelled';

export interface Job {
  name: string;  // operations/{id}
  kind: JobKind;
  subject: string;  // animations/{id} or families/{id}
  state: JobState;
  progress: Progress | undefined;
  version: bigint;  // that a registration published; 0: none
  grade: Verdict_Grade;
  error: ApiError | undefined;
}

const cancelled = 1;  // google.rpc.Code
const pageSize = 50;
const pauseMs = 1500;  // before a watch that was lost is begun again

function pause(ms: number): Promise<void> {
  return new Promise((resolve) => setTimeout(resolve, ms));
}

interface Metadata {
  kind: JobKind;
  subject: string;
  progress?: Progress | undefined;
  version: bigint;
  grade: Verdict_Grade;
}

function readMetadata(any: Any | undefined): Metadata {
  const registration = any && anyUnpack(any, RegisterFamilyMetadataSchema);
  if (registration) {
    const { family, progress, version, grade } = registration;
    return { kind: 'registration', subject: family, progress, version, grade };
  }
  const none = { version: 0n, grade: Verdict_Grade.GRADE_UNSPECIFIED };
  const animation = any && anyUnpack(any, ImportAnimationMetadataSchema);
  if (animation) {
    return { kind: 'import', subject: animation.animation, progress: animation.progress, ...none };
  }
  return { kind: 'job', subject: '', ...none };
}

function stateOf({ done, result }: Operation): JobState {
  if (!done) return 'running';
  if (result.case !== 'error') return 'done';
  return result.value.code === cancelled ? 'cancelled' : 'failed';
}

function errorOf(json: unknown): ApiError | undefined {
  const error = (json as { error?: unknown } | null)?.error;
  return error ? errorFromJson(400, error) : undefined;
}

/** Reads an operation's JSON. */
export function toJob(json: unknown): Job {
  const operation = fromServer(OperationSchema, json);
  return {
    name: operation.name,
    state: stateOf(operation),
    error: errorOf(json),
    progress: undefined,
    ...readMetadata(operation.metadata),
  };
}

/** When work on it ended, in milliseconds; undefined if it has not. */
export function endOf(job: Job): number | undefined {
  const end = job.progress?.endTime;
  return end && timestampMs(end);
}

export async function listJobs(pageToken = '', signal?: AbortSignal): Promise<Page<Job>> {
  const json = await getJson('/v1/operations', { pageSize, pageToken }, signal);
  const { nextPageToken } = fromServer(ListOperationsResponseSchema, json);
  const { operations = [] } = json as { operations?: unknown[] };
  return { items: operations.map(toJob), nextPageToken };
}

/** The operation each time it changes; ends after it is done. Errors: ApiError, AbortError. */
export async function* watchJob(name: string, signal: AbortSignal): AsyncGenerator<Job> {
  const response = await send(`/v1/operations/${idOf(name)}:watch`, { signal });
  if (!response.body) return;
  for await (const json of readLines(response.body)) yield toJob(json);
}

/**
 * watchJob() until the operation is done, also across lost connections and restarts of the server.
 * Errors: ApiError that is not temporary, AbortError.
 */
export async function* followJob(job: Job, signal: AbortSignal): AsyncGenerator<Job> {
  let last = job;
  while (last.state === 'running') {
    try {
      for await (const seen of watchJob(job.name, signal)) yield (last = seen);
    } catch (error) {
      if (isAbort(error) || !toApiError(error).isTemporary) throw error;
    }
    if (last.state === 'running') await pause(pauseMs);
    signal.throwIfAborted();
  }
}

export async function cancelJob(name: string): Promise<void> {
  await postJson(`/v1/operations/${idOf(name)}:cancel`, {});
}

export async function deleteJob(name: string): Promise<void> {
  await remove(`/v1/operations/${idOf(name)}`);
}
