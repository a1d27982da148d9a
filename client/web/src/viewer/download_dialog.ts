// Asks what to download, shows how far it is, and can cancel it.
import { LitElement, css, html, nothing } from 'lit';
import { customElement, property, query, state } from 'lit/decorators.js';
import { isAbort, toApiError, type ApiError } from '../api/errors.ts';
import { dialogStyles } from '../base/dialog_styles.ts';
import '../base/error_message.ts';
import { controls } from '../base/styles.ts';
import type { FileFormat } from '../stream/frame_request.ts';
import type { ViewModel } from '../view/model.ts';
import { download, type What } from './downloads.ts';

const choices: [What, string, string][] = [
  ['frame', 'This frame', 'the surface at this time and these weights'],
  ['animation', 'The whole animation', 'a tar archive with a file for each frame'],
  ['picture', 'A picture', 'what is seen, as PNG'],
];

const formats: [FileFormat, string][] = [
  ['ply', 'PLY (binary)'],
  ['obj', 'OBJ (text)'],
  ['drc', 'Draco (small)'],
];

@customElement('lb-download')
export class DownloadDialog extends LitElement {
  static override styles = [
    controls,
    dialogStyles,
    css`
      form {
        display: grid;
        gap: 14px;
      }
      fieldset {
        border: 0;
        margin: 0;
        padding: 0;
        display: grid;
        gap: 8px;
      }
      legend {
        font-weight: 600;
        padding: 0 0 6px;
      }
      label {
        display: grid;
        grid-template-columns: auto 1fr;
        gap: 0 8px;
        align-items: center;
      }
      label .muted {
        grid-column: 2;
        font-size: 12px;
      }
      progress {
        width: 100%;
        accent-color: var(--accent);
      }
    `,
  ];

  @property({ attribute: false }) model!: ViewModel;
  @state() private what: What = 'frame';
  @state() private format: FileFormat = 'ply';
  @state() private running: AbortController | undefined;
  @state() private done = [0, 1];
  @state() private error: ApiError | undefined;
  @query('dialog') private dialog!: HTMLDialogElement;

  open(): void {
    if (this.dialog.open) return;
    this.error = undefined;
    this.dialog.showModal();
  }

  override render() {
    return html`
      <dialog aria-labelledby="title" @cancel=${() => this.running?.abort()}>
        <form @submit=${this.onSubmit}>
          <h2 id="title">Download</h2>
          <fieldset ?disabled=${!!this.running}>
            <legend>What</legend>
            ${choices.map(([what, name, about]) => this.renderChoice(what, name, about))}
          </fieldset>
          ${this.what === 'picture' ? nothing : this.renderFormats()}
          ${this.running && this.what === 'animation' ? this.renderProgress() : nothing}
          <lb-error .error=${this.error}></lb-error>
          <div class="actions">
            <button type="button" @click=${this.onCancel}>
              ${this.running ? 'Cancel' : 'Close'}
            </button>
            <button class="primary" ?disabled=${!!this.running}>Download</button>
          </div>
        </form>
      </dialog>
    `;
  }

  private renderChoice(what: What, name: string, about: string) {
    return html`<label>
      <input
        type="radio"
        name="what"
        .checked=${this.what === what}
        @change=${() => (this.what = what)}
      />
      <span>${name}</span><span class="muted">${about}</span>
    </label>`;
  }

  private renderFormats() {
    return html`<fieldset ?disabled=${!!this.running}>
      <legend>Format</legend>
      ${formats.map(
        ([format, name]) =>
          html`<label>
            <input
              type="radio"
              name="format"
              .checked=${this.format === format}
              @change=${() => (this.format = format)}
            />
            <span>${name}</span>
          </label>`,
      )}
    </fieldset>`;
  }

  private renderProgress() {
    const [done, all] = this.done as [number, number];
    return html`
      <progress max=${all} .value=${done} aria-label="Frames downloaded"></progress>
      <p class="muted">Frame ${done + 1} of ${all}</p>
    `;
  }

  private onCancel(): void {
    if (this.running) this.running.abort();
    else this.dialog.close();
  }

  private async onSubmit(event: Event): Promise<void> {
    event.preventDefault();
    const controller = (this.running = new AbortController());
    this.error = undefined;
    this.done = [0, 1];
    try {
      const progress = (done: number, all: number) => (this.done = [done, all]);
      await download(this.model, this.what, this.format, controller.signal, progress);
      this.dialog.close();
    } catch (error) {
      if (!isAbort(error)) this.error = toApiError(error);
    } finally {
      this.running = undefined;
    }
  }
}
