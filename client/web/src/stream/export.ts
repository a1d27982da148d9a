// A whole animation as a tar of its frames.
import { send } from '../api/http.ts';
import type { FileSink } from '../base/save.ts';
import { tarEnd, tarHeader, tarPadding } from '../base/tar.ts';
import { framePath, type FileFormat, type FrameRequest } from './frame_request.ts';
import type { Timing } from './player.ts';

export interface ExportRequest {
  request: Omit<FrameRequest, 'timeS'>;
  timing: Timing;
  format: FileFormat;
  /** What `liquidblend import` reads beside the frames. */
  meta: object;
}

/** The times of all frames. */
export function frameTimes({ durationS, framesPerSecond }: Timing): number[] {
  const count = Math.floor(durationS * framesPerSecond + 1e-6) + 1;
  return Array.from({ length: count }, (_, frame) => Math.min(durationS, frame / framesPerSecond));
}

export function frameFileName(frame: number, format: FileFormat): string {
  return `frame_${String(frame + 1).padStart(4, '0')}.${format}`;
}

async function writeFile(
  sink: FileSink,
  name: string,
  data: Uint8Array<ArrayBuffer>,
): Promise<void> {
  await sink.write(tarHeader(name, data.length));
  await sink.write(data);
  await sink.write(tarPadding(data.length));
}

async function fetchFile(path: string, signal: AbortSignal): Promise<Uint8Array<ArrayBuffer>> {
  return new Uint8Array(await (await send(path, { signal })).arrayBuffer());
}

/** Fetches one frame ahead of the one that is written, so memory holds two. */
export async function exportAnimation(
  { request, timing, format, meta }: ExportRequest,
  sink: FileSink,
  signal: AbortSignal,
  progress: (done: number, all: number) => void,
): Promise<void> {
  const times = frameTimes(timing);
  const fetchAt = (frame: number) => {
    const timeS = times[frame];
    if (timeS === undefined) return undefined;
    const file = fetchFile(framePath({ ...request, timeS }, format), signal);
    file.catch(() => {}); // told where it is awaited
    return file;
  };
  try {
    let next = fetchAt(0);
    for (let frame = 0; next; ++frame) {
      progress(frame, times.length);
      const data = await next;
      next = fetchAt(frame + 1);
      await writeFile(sink, frameFileName(frame, format), data);
    }
    await writeFile(sink, 'meta.json', new TextEncoder().encode(JSON.stringify(meta, null, 1)));
    await sink.write(tarEnd());
    await sink.close();
  } catch (error) {
    await sink.abort();
    throw error;
  }
}
