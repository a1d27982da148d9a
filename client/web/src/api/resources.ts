// Animations and families of the server.
import {
  AnimationSchema,
  FamilySchema,
  ListAnimationsResponseSchema,
  ListFamiliesResponseSchema,
  type Animation,
  type Family,
} from '../generated/liquidblend/v1/liquidblend_pb.ts';
import { getJson, idOf } from './http.ts';
import { fromServer } from './messages.ts';

/** A part of a list, and the token of the next one; empty at the end. */
export interface Page<T> {
  items: T[];
  nextPageToken: string;
}

const pageSize = 100;

export async function listFamilies(pageToken = '', signal?: AbortSignal): Promise<Page<Family>> {
  const json = await getJson('/v1/families', listQuery(pageToken), signal);
  const response = fromServer(ListFamiliesResponseSchema, json);
  return { items: response.families, nextPageToken: response.nextPageToken };
}

export async function listAnimations(
  pageToken = '',
  signal?: AbortSignal,
): Promise<Page<Animation>> {
  const json = await getJson('/v1/animations', listQuery(pageToken), signal);
  const response = fromServer(ListAnimationsResponseSchema, json);
  return { items: response.animations, nextPageToken: response.nextPageToken };
}

// Servers that know no camelCase fields in queries know these.
function listQuery(pageToken: string) {
  return { page_size: pageSize, page_token: pageToken };
}

/** Version 0n: the published one. */
export async function getFamily(name: string, version = 0n, signal?: AbortSignal): Promise<Family> {
  const query = version ? { version: String(version) } : {};
  return fromServer(FamilySchema, await getJson(`/v1/families/${idOf(name)}`, query, signal));
}

export async function getAnimation(name: string, signal?: AbortSignal): Promise<Animation> {
  return fromServer(AnimationSchema, await getJson(`/v1/animations/${idOf(name)}`, {}, signal));
}
