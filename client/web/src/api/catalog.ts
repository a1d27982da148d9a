// What the server has: all pages of its lists of families and animations, kept for all sections.
import { Observable } from '../base/observable.ts';
import { toApiError, type ApiError } from './errors.ts';
import { listAnimations, listFamilies, type Page } from './resources.ts';
import type { Animation, Family } from '../generated/liquidblend/v1/liquidblend_pb.ts';

export interface CatalogState {
  families: Family[];
  animations: Animation[];
  loading: boolean;
  error?: ApiError;
}

type Fetch<T> = (pageToken: string, signal: AbortSignal) => Promise<Page<T>>;

/** Lists of the server. `refresh` reads them again; the newest call wins. */
export class Catalog extends Observable<CatalogState> {
  private controller = new AbortController();

  constructor() {
    super({ families: [], animations: [], loading: false });
  }

  async refresh(): Promise<void> {
    this.controller.abort();
    const controller = (this.controller = new AbortController());
    const { signal } = controller;
    this.patch({ loading: true });
    const results = await Promise.allSettled([
      readPages<Family>(listFamilies, signal, (families) => this.patch({ families })),
      readPages<Animation>(listAnimations, signal, (animations) => this.patch({ animations })),
    ]);
    if (signal.aborted) return;
    const failed = results.find((result) => result.status === 'rejected');
    this.finish(failed && toApiError(failed.reason));
  }

  private finish(error: ApiError | undefined): void {
    const { error: _before, ...state } = this.value;
    this.set({ ...state, loading: false, ...(error ? { error } : {}) });
  }

  private patch(change: Partial<CatalogState>): void {
    this.set({ ...this.value, ...change });
  }
}

// Tells what is there after each page.
async function readPages<T>(
  fetchPage: Fetch<T>,
  signal: AbortSignal,
  tell: (items: T[]) => void,
): Promise<void> {
  let items: T[] = [];
  let pageToken = '';
  do {
    const page = await fetchPage(pageToken, signal);
    signal.throwIfAborted();
    items = items.concat(page.items);
    pageToken = page.nextPageToken;
    tell(items);
  } while (pageToken);
}

export const catalog = new Catalog();
