// Requests that change what the server has.
import { FamilySchema, type Family } from '../generated/liquidblend/v1/liquidblend_pb.ts';
import { idOf, postJson, remove } from './http.ts';
import { fromServer } from './messages.ts';
import { toJob, type Job } from './operations.ts';

/** A message as protobuf's JSON. */
export type Json = Record<string, unknown>;

/** `request`: a RegisterFamilyRequest. */
export async function registerFamily(request: Json): Promise<Job> {
  return toJob(await postJson('/v1/families', { requestId: newRequestId(), ...request }));
}

export async function rollbackFamily(name: string, version: bigint): Promise<Family> {
  const json = await postJson(`/v1/families/${idOf(name)}:rollback`, { version: String(version) });
  return fromServer(FamilySchema, json);
}

/** Deletes an animation or a family with all of its versions. */
export async function deleteResource(name: string): Promise<void> {
  const collection = name.startsWith('families/') ? 'families' : 'animations';
  await remove(`/v1/${collection}/${idOf(name)}`);
}

/** A request that is sent twice is done once. */
export function newRequestId(): string {
  const bytes = crypto.getRandomValues(new Uint8Array(16));
  return `page-${Array.from(bytes, (byte) => byte.toString(16).padStart(2, '0')).join('')}`;
}
