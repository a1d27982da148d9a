import { LitElement, html } from 'lit';
import { customElement, property } from 'lit/decorators.js';
import type { ViewModel } from './model.ts';

@customElement('lb-download')
export class DownloadDialog extends LitElement {
  @property({ attribute: false }) model!: ViewModel;
  open(): void {}
  override render() {
    return html``;
  }
}
