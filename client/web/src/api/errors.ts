// Errors of the server, as google.rpc.Status in JSON, and what a person reads of them.

export interface ErrorDetail {
  label: string;
  text: string;
}

/** An error that the server answered, or that kept it from answering (status 0). */
export class ApiError extends Error {
  constructor(
    readonly status: number,
    message: string,
    readonly details: ErrorDetail[] = [],
    readonly reason = '',
    readonly retryAfterS = 0,
  ) {
    super(message);
    this.name = 'ApiError';
  }

  get needsToken(): boolean {
    return this.status === 401;
  }

  /** Whether the same request may succeed later. */
  get isTemporary(): boolean {
    return this.status === 0 || this.status === 429 || this.status >= 500;
  }
}

type Json = Record<string, unknown>;

function isObject(value: unknown): value is Json {
  return typeof value === 'object' && value !== null && !Array.isArray(value);
}

function text(value: unknown): string {
  return typeof value === 'string' ? value : '';
}

function objects(value: unknown): Json[] {
  return Array.isArray(value) ? value.filter(isObject) : [];
}

function badRequest(detail: Json): ErrorDetail[] {
  return objects(detail.fieldViolations).map((violation) => ({
    label: text(violation.field) || 'request',
    text: text(violation.description),
  }));
}

function errorInfo(detail: Json): ErrorDetail[] {
  const metadata = isObject(detail.metadata) ? Object.entries(detail.metadata) : [];
  return [
    { label: 'reason', text: text(detail.reason) },
    ...metadata.map(([label, value]) => ({ label, text: String(value) })),
  ];
}

const readers: Record<string, (detail: Json) => ErrorDetail[]> = {
  BadRequest: badRequest,
  ErrorInfo: errorInfo,
  RetryInfo: (detail) => [{ label: 'retry after', text: text(detail.retryDelay) }],
  RequestInfo: (detail) => [{ label: 'request', text: text(detail.requestId) }],
  ResourceInfo: (detail) => [
    { label: text(detail.resourceType) || 'resource', text: text(detail.resourceName) },
  ],
};

function readDetail(detail: Json): ErrorDetail[] {
  const type = text(detail['@type']).split(/[./]/).pop() ?? '';
  return (readers[type]?.(detail) ?? []).filter((line) => line.text);
}

function reasonOf(details: Json[]): string {
  return text(details.find((detail) => text(detail['@type']).endsWith('.ErrorInfo'))?.reason);
}

function retryAfterOf(details: Json[]): number {
  const delay = details.find((detail) => text(detail['@type']).endsWith('.RetryInfo'))?.retryDelay;
  return Number.parseFloat(text(delay)) || 0;
}

/** Reads a google.rpc.Status; anything else becomes an error with the status alone. */
export function errorFromJson(status: number, json: unknown): ApiError {
  if (!isObject(json) || !text(json.message)) return new ApiError(status, statusText(status));
  const details = objects(json.details);
  return new ApiError(
    status,
    text(json.message),
    details.flatMap(readDetail),
    reasonOf(details),
    retryAfterOf(details),
  );
}

function statusText(status: number): string {
  if (status === 0) return 'The server cannot be reached.';
  if (status === 401) return 'The server wants a token.';
  return `The server answered with status ${status}.`;
}

/** Code of the page is missing: the server has another version of it. */
export function staleError(): ApiError {
  return new ApiError(0, 'A part of the page is missing. Reload it: the server may be newer.');
}

/** Any error that was caught, as an ApiError. */
export function toApiError(error: unknown): ApiError {
  if (error instanceof ApiError) return error;
  if (error instanceof TypeError) return new ApiError(0, statusText(0));
  return new ApiError(0, error instanceof Error ? error.message : String(error));
}

export function isAbort(error: unknown): boolean {
  return error instanceof DOMException && error.name === 'AbortError';
}
