// The viewer of a family.
import { LitElement, html } from 'lit';
import { customElement } from 'lit/decorators.js';

@customElement('lb-viewer')
export class Viewer extends LitElement {
  override render() {
    return html`<p>Nothing is shown yet.</p>`;
  }
}
