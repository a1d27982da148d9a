// The upload that runs, whatever view is open. Leaving the page asks first.
import { isAbort, toApiError, type ApiError } from '../api/errors.ts';
import { Observable } from '../base/observable.ts';
import type { Folder } from './folder.ts';
import { jobBoard } from './job_board.ts';
import { uploadAnimation, type ImportSettings } from './upload.ts';

export interface UploadState {
  folder: Folder | undefined;  // that is sent, or that was not; undefined: none
  animationId: string;
  busy: boolean;
  sent: number;  // bytes
  total: number;
  error: ApiError | undefined;
}

const idle: UploadState = {
  folder: undefined,
  animationId: '',
  busy: false,
  sent: 0,
  total: 0,
  error: undefined,
};

function keepPage(event: BeforeUnloadEvent): void {
  event.preventDefault();
}

export class CurrentUpload extends Observable<UploadState> {
  private controller = new AbortController();

  constructor() {
    super(idle);
  }

  /** Forgets what became of a former one. Requires: none is running. */
  choose(folder: Folder | undefined, animationId = '', error?: ApiError): void {
    this.set({ ...idle, folder, animationId, error });
  }

  rename(animationId: string): void {
    this.patch({ animationId });
  }

  refuse(error: ApiError): void {
    this.patch({ error });
  }

  stop(): void {
    this.controller.abort();
  }

  /** Whether it arrived. One at a time. */
  async begin(settings: ImportSettings): Promise<boolean> {
    const { folder, animationId, busy } = this.value;
    if (busy || !folder) return false;
    this.controller = new AbortController();
    const total = folder.files.reduce((bytes, { size }) => bytes + size, 0);
    this.patch({ busy: true, sent: 0, total: Math.max(1, total), error: undefined });
    window.addEventListener('beforeunload', keepPage);
    try {
      await this.send(folder, animationId, settings);
      this.set(idle);
      return true;
    } catch (error) {
      this.patch({ busy: false, error: isAbort(error) ? undefined : toApiError(error) });
      return false;
    } finally {
      window.removeEventListener('beforeunload', keepPage);
    }
  }

  private async send({ files }: Folder, id: string, settings: ImportSettings): Promise<void> {
    const progress = (sent: number, total: number) =>
      this.patch({ sent: Math.min(sent, total), total });
    const { signal } = this.controller;
    jobBoard.add(await uploadAnimation(id, files, settings, { progress }, signal));
  }

  private patch(change: Partial<UploadState>): void {
    this.set({ ...this.value, ...change });
  }
}

export const currentUpload = new CurrentUpload();
