// The state of the page in the fragment of its URL: #section?field=value&..
// Fragments are sent to no server and stand in no log.
import { Observable } from './observable.ts';

export interface PageLocation {
  section: string;
  fields: URLSearchParams;
}

// Browsers refuse more than 100 changes of the history in 30 s.
const writeIntervalMs = 400;

export function parseHash(hash: string): PageLocation {
  const text = hash.replace(/^#/, '');
  const mark = text.indexOf('?');
  if (mark < 0) return { section: text, fields: new URLSearchParams() };
  return { section: text.slice(0, mark), fields: new URLSearchParams(text.slice(mark + 1)) };
}

export function formatHash({ section, fields }: PageLocation): string {
  const text = fields.toString().replaceAll('%2C', ',').replaceAll('%3A', ':');
  return text ? `#${section}?${text}` : `#${section}`;
}

/** The location now. Changes by the user (links, back, typed) are told to subscribers. */
export class HashLocation {
  private readonly changes: Observable<PageLocation>;
  private current: PageLocation;  // as the URL has it
  private hash: string;  // of it
  private pending: PageLocation | undefined;
  private timer = 0;

  constructor(private readonly target: Window = window) {
    this.hash = target.location.hash;
    this.current = parseHash(this.hash);
    this.changes = new Observable(this.current);
    target.addEventListener('hashchange', () => this.read());
    target.addEventListener('pagehide', () => this.flush());
  }

  get value(): PageLocation {
    return this.pending ?? this.current;
  }

  subscribe(listener: (location: PageLocation) => void): () => void {
    return this.changes.subscribe(listener);
  }

  /** Shows another place; the one before is in the history. */
  go(location: PageLocation): void {
    this.flush();
    this.target.history.pushState(null, '', formatHash(location));
    this.hash = this.target.location.hash;
    this.current = location;
    this.changes.set(location);
  }

  /** Shows another place instead of this one. */
  show(location: PageLocation): void {
    this.replace(location);
    this.flush();
    this.changes.set(location);
  }

  /** Writes the state of this place, now or soon. Subscribers are not told. */
  replace(location: PageLocation): void {
    this.pending = location;
    this.timer ||= this.target.setTimeout(() => this.flush(), writeIntervalMs);
  }

  /** Writes what waits. */
  flush(): void {
    this.target.clearTimeout(this.timer);
    this.timer = 0;
    const { pending, target } = this;
    this.pending = undefined;
    // Another place was opened, and its event is still to come.
    if (!pending || target.location.hash !== this.hash) return;
    const hash = formatHash(pending);
    this.current = pending;
    if (hash !== this.hash) target.history.replaceState(null, '', hash);
    this.hash = target.location.hash;
  }

  private read(): void {
    this.target.clearTimeout(this.timer);
    this.timer = 0;
    this.pending = undefined;
    this.hash = this.target.location.hash;
    this.current = parseHash(this.hash);
    this.changes.set(this.current);
  }
}

export const pageLocation = typeof window === 'undefined' ? undefined! : new HashLocation();
