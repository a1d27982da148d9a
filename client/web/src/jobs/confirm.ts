// Asks before something is deleted.
import { LitElement, css, html } from 'lit';
import { customElement, query, state } from 'lit/decorators.js';
import { controls } from '../base/styles.ts';
import { dialogStyles } from '../base/dialog_styles.ts';

export interface Question {
  title: string;
  text: string;
  verb: string;
}

@customElement('lb-confirm')
export class Confirm extends LitElement {
  static override styles = [
    controls,
    dialogStyles,
    css`
      form { display: grid; gap: 14px; }
      p { overflow-wrap: anywhere; }
      h2 { overflow-wrap: anywhere; }
      button.danger { background: var(--bad); border-color: var(--bad); color: var(--panel); }
    `,
  ];

  @state() private question: Question = { title: '', text: '', verb: '' };
  @query('dialog') private dialog!: HTMLDialogElement;
  private answer: ((yes: boolean) => void) | undefined;

  /** Whether the person says yes. */
  async ask(question: Question): Promise<boolean> {
    this.question = question;
    await this.updateComplete;
    this.dialog.returnValue = '';
    this.dialog.showModal();
    return new Promise((resolve) => (this.answer = resolve));
  }

  override render() {
    const { title, text, verb } = this.question;
    return html`
      <dialog aria-labelledby="title" @close=${this.onClose}>
        <form method="dialog">
          <h2 id="title">${title}</h2>
          <p>${text}</p>
          <div class="actions">
            <button value="" autofocus>Cancel</button>
            <button class="danger" value="yes">${verb}</button>
          </div>
        </form>
      </dialog>
    `;
  }

  private onClose(): void {
    this.answer?.(this.dialog.returnValue === 'yes');
    this.answer = undefined;
  }
}
