// Requests to the server that this page came from.
import { authorization } from './token.ts';
import { ApiError, errorFromJson, isAbort, toApiError } from './errors.ts';

export type Query = Record<string, string | number | boolean | undefined>;

/** A path with the fields of a query that are set. */
export function withQuery(path: string, query: Query = {}): string {
  const fields = new URLSearchParams();
  for (const [name, value] of Object.entries(query)) {
    if (value !== undefined && value !== '') fields.set(name, String(value));
  }
  const text = fields.toString();
  return text ? `${path}?${text}` : path;
}

/** The last part of a resource's name, as a part of a path. */
export function idOf(name: string): string {
  return encodeURIComponent(name.slice(name.lastIndexOf('/') + 1));
}

/** Errors: ApiError, or AbortError if the signal ended it. */
export async function send(path: string, init: RequestInit = {}): Promise<Response> {
  const headers = { ...authorization(), ...(init.headers as Record<string, string>) };
  let response: Response;
  try {
    response = await fetch(path, { ...init, headers, redirect: 'error' });
  } catch (error) {
    throw isAbort(error) ? error : toApiError(error);
  }
  if (!response.ok) throw await readError(response);
  return response;
}

async function readError(response: Response): Promise<ApiError> {
  try {
    return errorFromJson(response.status, await response.json());
  } catch (error) {
    if (isAbort(error)) throw error;
    return errorFromJson(response.status, undefined);
  }
}

export async function getJson(path: string, query?: Query, signal?: AbortSignal): Promise<unknown> {
  return (await send(withQuery(path, query), { signal: signal ?? null })).json();
}

export async function postJson(
  path: string,
  body: unknown,
  signal?: AbortSignal,
): Promise<unknown> {
  const response = await send(path, {
    method: 'POST',
    headers: { 'Content-Type': 'application/json' },
    body: JSON.stringify(body),
    signal: signal ?? null,
  });
  return response.json();
}

export async function remove(path: string, signal?: AbortSignal): Promise<void> {
  await send(path, { method: 'DELETE', signal: signal ?? null });
}
