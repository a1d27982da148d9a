// Sends the files of an animation as one tar archive.
import { ApiError, errorFromJson } from '../api/errors.ts';
import { withQuery } from '../api/http.ts';
import { newRequestId } from '../api/changes.ts';
import { toJob, type Job } from '../api/operations.ts';
import { authorization } from '../api/token.ts';
import { tarOf } from './tar.ts';

export interface ImportSettings {
  framesPerSecond?: number | undefined;
  vertexScale?: number | undefined;
  up?: string | undefined;  // UP_Z and so on
  pattern?: string | undefined;
  allowGaps?: boolean | undefined;
}

export interface UploadEvents {
  progress(sent: number, total: number): void;
}

function pathOf(animationId: string, settings: ImportSettings, numFiles: number): string {
  const options = Object.entries(settings).filter(([, value]) => value);
  return withQuery('/v1/animations:upload', {
    'header.animationId': animationId,
    ...Object.fromEntries(options.map(([name, value]) => [`header.options.${name}`, value])),
    'header.numFiles': numFiles,
    'header.requestId': newRequestId(),
  });
}

function jsonOf(text: string): unknown {
  try {
    return JSON.parse(text);
  } catch {
    return undefined;
  }
}

/**
 * Only XMLHttpRequest tells how much was sent. Errors: ApiError; AbortError if the signal ended it.
 */
export function uploadAnimation(
  animationId: string,
  files: File[],
  settings: ImportSettings,
  events: UploadEvents,
  signal: AbortSignal,
): Promise<Job> {
  const request = new XMLHttpRequest();
  const archive = tarOf(files.map((file) => ({ name: file.name, file })));
  return new Promise((resolve, reject) => {
    request.upload.onprogress = (event) => events.progress(event.loaded, archive.size);
    request.onload = () => {
      const json = jsonOf(request.responseText);
      if (request.status === 200 && json) resolve(toJob(json));
      else reject(errorFromJson(request.status, json));
    };
    request.onerror = () => reject(new ApiError(0, 'The upload was cut off.'));
    request.onabort = () => reject(new DOMException('The upload was stopped.', 'AbortError'));
    signal.addEventListener('abort', () => request.abort());
    request.open('POST', pathOf(animationId, settings, files.length));
    for (const [name, value] of Object.entries(authorization()))
      request.setRequestHeader(name, value);
    request.setRequestHeader('Content-Type', 'application/x-tar');
    request.send(archive);
  });
}
