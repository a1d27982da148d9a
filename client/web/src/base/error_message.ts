// An error of the server as text, with its details.
import { LitElement, css, html, nothing } from 'lit';
import { customElement, property } from 'lit/decorators.js';
import type { ApiError } from '../api/errors.ts';
import { controls } from './styles.ts';

@customElement('lb-error')
export class ErrorMessage extends LitElement {
  static override styles = [
    controls,
    css`
      div {
        padding: 8px 12px;
        border-radius: 6px;
        background: var(--bad-soft);
        color: var(--bad);
      }
      p {
        margin: 0;
        overflow-wrap: anywhere;
      }
      dl {
        margin: 6px 0 0;
        display: grid;
        grid-template-columns: auto 1fr;
        gap: 0 8px;
      }
      dt {
        font-weight: 600;
      }
      dd {
        margin: 0;
        overflow-wrap: anywhere;
      }
    `,
  ];

  @property({ attribute: false }) error?: ApiError | undefined;

  override render() {
    const error = this.error;
    if (!error) return nothing;
    return html`
      <div role="alert">
        <p>${error.message}</p>
        ${
          error.details.length
            ? html`<dl>
                ${error.details.map(
                  (line) =>
                    html`<dt>${line.label}</dt>
                      <dd>${line.text}</dd>`,
                )}
              </dl>`
            : nothing
        }
      </div>
    `;
  }
}
