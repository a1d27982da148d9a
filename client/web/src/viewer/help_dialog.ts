// The keys of the viewer.
import { LitElement, css, html } from 'lit';
import { customElement, query } from 'lit/decorators.js';
import { dialogStyles } from '../base/dialog_styles.ts';
import { controls } from '../base/styles.ts';

const lines: [string, string][] = [
  ['Space, k', 'play and pause'],
  [', and .', 'one frame back and on'],
  ['Home, End', 'first and last frame'],
  ['l', 'loop: once, all, range'],
  ['[ and ]', 'begin and end of the range'],
  ['s, w, p', 'shading, wireframe, pattern'],
  ['f', 'fit into view'],
  ['d', 'download'],
  ['?', 'these keys'],
];

const pictureLines: [string, string][] = [
  ['Arrow keys, drag', 'turn'],
  ['Shift and arrow keys or drag', 'move'],
  ['+ and -, wheel, pinch', 'zoom'],
  ['Double click', 'fit into view'],
];

@customElement('lb-help')
export class HelpDialog extends LitElement {
  static override styles = [
    controls,
    dialogStyles,
    css`
      h3 {
        margin: 16px 0 6px;
        font-size: 13px;
        color: var(--muted);
      }
      dl {
        display: grid;
        grid-template-columns: auto 1fr;
        gap: 6px 18px;
        margin: 0;
      }
      dt {
        font-family: var(--mono);
        font-size: 13px;
      }
      dd {
        margin: 0;
      }
      .actions {
        margin-top: 16px;
      }
    `,
  ];

  @query('dialog') private dialog!: HTMLDialogElement;

  open(): void {
    if (!this.dialog.open) this.dialog.showModal();
  }

  override render() {
    return html`
      <dialog aria-labelledby="title">
        <h2 id="title">Keys</h2>
        <h3>Anywhere</h3>
        ${renderLines(lines)}
        <h3>In a picture</h3>
        ${renderLines(pictureLines)}
        <div class="actions">
          <button class="primary" @click=${() => this.dialog.close()}>Close</button>
        </div>
      </dialog>
    `;
  }
}

function renderLines(items: [string, string][]) {
  return html`<dl>
    ${items.map(
      ([key, does]) =>
        html`<dt>${key}</dt>
          <dd>${does}</dd>`,
    )}
  </dl>`;
}
