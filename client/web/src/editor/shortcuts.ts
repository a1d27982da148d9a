// The keys of the editor.
import { LitElement, css, html } from 'lit';
import { customElement, query } from 'lit/decorators.js';
import { dialogStyles } from '../base/dialog_styles.ts';
import { controls } from '../base/styles.ts';

const lines: [string, string][] = [
  ['click', 'mark a place: source and target in turn'],
  ['drag a marker', 'move it along the surface, to the time of the cursor'],
  ['Ctrl + click', 'switch a pair off or on'],
  ['drag, wheel', 'turn, zoom; with Shift: move'],
  ['Tab', 'pictures, markers, time, lists'],
  ['Enter in a picture', 'mark the place in its middle'],
  ['arrow keys on a marker', 'move it on the surface; with Shift: finely'],
  ['Enter on a marker', 'go to the times of its pair'],
  ['Delete', 'delete the selected pair; the others keep their numbers'],
  ['x', 'switch the selected pair off or on'],
  ['h', 'hard or soft'],
  ['t', 'point, trajectory, space'],
  ['c', 'check pair or not'],
  ['e', 'end a trajectory or space at the cursor of the source'],
  ['n, p', 'next, previous pair'],
  [', .', 'source: a frame back, forward'],
  ['< >', 'target: a frame back, forward'],
  ['Ctrl + Z', 'undo'],
  ['Ctrl + Shift + Z', 'do again'],
  ['f', 'fit into view'],
  ['?', 'these keys'],
];

@customElement('lb-shortcuts')
export class Shortcuts extends LitElement {
  static override styles = [
    controls,
    dialogStyles,
    css`
      h2 { margin-bottom: 12px; }
      dl { display: grid; grid-template-columns: auto 1fr; gap: 6px 16px; margin: 0 0 16px; }
      dt { font: 13px var(--mono); }
      dd { margin: 0; }
    `,
  ];

  @query('dialog') private dialog!: HTMLDialogElement;

  open(): void {
    if (!this.dialog.open) this.dialog.showModal();
  }

  override render() {
    return html`<dialog aria-labelledby="title">
      <h2 id="title">Keys of the editor</h2>
      <dl>${lines.map(([key, text]) => html`<dt>${key}</dt><dd>${text}</dd>`)}</dl>
      <div class="actions"><button class="primary"
        @click=${() => this.dialog.close()}>Close</button></div>
    </dialog>`;
  }
}
