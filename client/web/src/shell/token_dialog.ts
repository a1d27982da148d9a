// Asks for the token of the server.
import { LitElement, css, html } from 'lit';
import { customElement, query } from 'lit/decorators.js';
import { setToken, token } from '../api/token.ts';
import { controls } from '../base/styles.ts';
import { dialogStyles } from '../base/dialog_styles.ts';

@customElement('lb-token-dialog')
export class TokenDialog extends LitElement {
  static override styles = [
    controls,
    dialogStyles,
    css`
      form {
        display: grid;
        gap: 12px;
      }
      label {
        display: grid;
        gap: 4px;
        font-weight: 600;
      }
      input {
        width: 100%;
      }
    `,
  ];

  @query('dialog') private dialog!: HTMLDialogElement;
  @query('input') private input!: HTMLInputElement;

  open(): void {
    if (this.dialog.open) return;
    this.input.value = token.value;
    this.dialog.showModal();
  }

  override render() {
    return html`
      <dialog aria-labelledby="title">
        <form method="dialog" @submit=${() => setToken(this.input.value.trim())}>
          <h2 id="title">Token</h2>
          <p class="muted">
            A server with tokens answers only those who have one. It is kept in this tab and
            forgotten when the tab is closed.
          </p>
          <label>Token <input type="password" autocomplete="off" spellcheck="false" /></label>
          <div class="actions">
            <button type="button" @click=${() => this.dialog.close()}>Cancel</button>
            <button class="primary">Use</button>
          </div>
        </form>
      </dialog>
    `;
  }
}
