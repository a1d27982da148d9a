// Lines of JSON (application/x-ndjson) as they come in pieces.
import { errorFromJson } from './errors.ts';

/** Puts pieces of text together to lines; empty ones are left out. */
export class LineSplitter {
  private rest = '';

  push(piece: string): string[] {
    const lines = (this.rest + piece).split('\n');
    this.rest = lines.pop()!;
    return lines.map((line) => line.trim()).filter(Boolean);
  }

  /** What came after the last end of a line. */
  end(): string[] {
    const last = this.rest.trim();
    this.rest = '';
    return last ? [last] : [];
  }
}

function isObject(value: unknown): value is Record<string, unknown> {
  return typeof value === 'object' && value !== null && !Array.isArray(value);
}

/** Reads a line. Errors: ApiError for a line that is {"error": google.rpc.Status} or no JSON. */
export function parseLine(line: string): unknown {
  let json: unknown;
  try {
    json = JSON.parse(line);
  } catch {
    throw errorFromJson(500, { message: 'The server sent a line that is not JSON.' });
  }
  if (isObject(json) && isObject(json.error) && !('name' in json)) {
    throw errorFromJson(500, json.error);
  }
  return json;
}

/** The lines of an answer's body. */
export async function* readLines(body: ReadableStream<Uint8Array>): AsyncGenerator<unknown> {
  const splitter = new LineSplitter();
  const decoder = new TextDecoder();
  const reader = body.getReader();
  try {
    for (;;) {
      const { done, value } = await reader.read();
      const lines = done ? splitter.end() : splitter.push(decoder.decode(value, { stream: true }));
      for (const line of lines) yield parseLine(line);
      if (done) return;
    }
  } finally {
    reader.cancel().catch(() => {});
  }
}
