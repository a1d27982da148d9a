// Follows a value while an element is in the document.
import type { ReactiveController, ReactiveControllerHost } from 'lit';
import type { Observable } from './observable.ts';

/** Renders the element anew, or calls `onChange`, when the value changes. */
export class Observing<T> implements ReactiveController {
  private unsubscribe = () => {};

  /** `observable` is asked for when the element enters the document. */
  constructor(
    host: ReactiveControllerHost,
    private readonly observable: () => Observable<T>,
    private readonly onChange: (value: T) => void = () => host.requestUpdate(),
  ) {
    host.addController(this);
  }

  hostConnected(): void {
    this.unsubscribe = this.observable().subscribe(this.onChange);
  }

  hostDisconnected(): void {
    this.unsubscribe();
  }
}
