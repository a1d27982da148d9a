// Upload of a folder of frames: dropped or chosen, with the options of the import that matter.
import { LitElement, css, html, nothing } from 'lit';
import { customElement, query, state } from 'lit/decorators.js';
import { toApiError, ApiError } from '../api/errors.ts';
import { idRule, isId, toId } from '../api/names.ts';
import '../base/error_message.ts';
import { textOf } from '../base/events.ts';
import { formatBytes } from '../base/format.ts';
import { Observing } from '../base/observing.ts';
import { controls } from '../base/styles.ts';
import { currentUpload } from './current_upload.ts';
import { folderOfDrop, folderOfInput, type Folder } from './folder.ts';
import { jobsStyles } from './jobs_styles.ts';
import type { ImportSettings } from './upload.ts';

const ups = ['', 'UP_X', 'UP_Y', 'UP_Z', 'UP_MINUS_X', 'UP_MINUS_Y', 'UP_MINUS_Z'];

const hint = 'Mantaflow cache, PLY, OBJ, STL or OpenVDB: one folder is one animation.';

function upName(up: string): string {
  return up ? up.slice(3).replace('MINUS_', '-').toLowerCase() : 'from the files';
}

function describe({ files, numSkipped }: Folder): string {
  const bytes = files.reduce((total, file) => total + file.size, 0);
  const skipped = numSkipped ? `; ${numSkipped} others are left out` : '';
  return `${files.length} files, ${formatBytes(bytes)}${skipped}`;
}

/** Tells of an upload that arrived by the event `uploaded`. */
@customElement('lb-upload')
export class UploadView extends LitElement {
  static override styles = [
    controls,
    jobsStyles,
    css`
      .drop { display: grid; gap: 10px; justify-items: center; padding: 36px 20px;
        text-align: center;
        border: 2px dashed var(--control); border-radius: var(--radius); background: var(--raised);
        }
      .drop.over { border-color: var(--accent); background: var(--accent-soft); }
      .drop strong { font-size: 15px; overflow-wrap: anywhere; }
      form { display: grid; gap: 16px; }
    `,
  ];

  @state() private over = false;
  @query('input[type=file]') private chooser!: HTMLInputElement;
  @query('form') private form!: HTMLFormElement;
  readonly observing = new Observing(this, () => currentUpload);

  override render() {
    const { folder, busy, error } = currentUpload.value;
    return html`
      <div class="view">
        <div
          class="drop ${this.over ? 'over' : ''}"
          @dragover=${this.onDragOver}
          @dragleave=${() => (this.over = false)}
          @drop=${this.onDrop}
        >
          <strong>${folder ? folder.name || 'Files' : 'Drop a folder of frames here'}</strong>
          <span class="hint">
            ${folder ? describe(folder) : hint}
          </span>
          <button type="button" ?disabled=${busy} @click=${() => this.chooser.click()}>
            ${folder ? 'Choose another folder' : 'Choose a folder'}
          </button>
          <input type="file" aria-label="Folder of frames" webkitdirectory multiple hidden
            @change=${this.onChosen} />
        </div>
        <lb-error .error=${error}></lb-error>
        ${folder ? this.renderForm() : nothing}
      </div>
    `;
  }

  private renderForm() {
    return html`
      <form class="card" @submit=${this.onSubmit}>
        <h2>Import</h2>
        <div class="fields">
          <label class="field">Name
            <input name="animation" required maxlength="63" autocomplete="off" spellcheck="false"
              .value=${currentUpload.value.animationId} @input=${this.onName}
              aria-describedby="rule" />
            <span class="hint" id="rule">${idRule}</span>
          </label>
          <label class="field">Frames a second
            <input name="fps" type="number" min="0.001" step="any"
              placeholder="from meta.json, else 24" />
          </label>
          <label class="field">Scale
            <input name="scale" type="number" min="0" step="any"
              placeholder="from meta.json, else 1" />
            <span class="hint">metres per unit of the files</span>
          </label>
          <label class="field">Up
            <select name="up">
              ${ups.map((up) => html`<option value=${up}>${upName(up)}</option>`)}
            </select>
          </label>
          <label class="field">Pattern
            <input name="pattern" maxlength="255" placeholder="all frames" spellcheck="false" />
            <span class="hint">such as liquid.* where a folder has several sequences</span>
          </label>
          <label class="check"><input name="gaps" type="checkbox" /> Numbers may be missing</label>
        </div>
        ${currentUpload.value.busy ? this.renderProgress() : html`<div class="actions">
        <button class="primary">Upload</button></div>`}
      </form>
    `;
  }

  private renderProgress() {
    const { sent, total } = currentUpload.value;
    const text =
      sent < total
        ? `${formatBytes(sent)} of ${formatBytes(total)} sent`
        : 'All is sent; the server looks at it';
    return html`
      <progress max=${total || 1} .value=${sent} aria-label="Progress of the upload"></progress>
      <div class="actions">
        <button type="button" @click=${() => currentUpload.stop()}>Stop</button>
        <span class="hint" role="status">${text}</span>
      </div>
    `;
  }

  private onName(event: Event): void {
    currentUpload.rename(textOf(event));
  }

  private onDragOver(event: DragEvent): void {
    event.preventDefault();
    this.over = true;
  }

  private onDrop(event: DragEvent): void {
    event.preventDefault();
    this.over = false;
    const { dataTransfer } = event;
    if (dataTransfer && !currentUpload.value.busy) void this.take(folderOfDrop(dataTransfer));
  }

  private onChosen(): void {
    const { files } = this.chooser;
    if (files?.length) void this.take(Promise.resolve(folderOfInput(files)));
    this.chooser.value = '';
  }

  private async take(reading: Promise<Folder>): Promise<void> {
    try {
      const folder = await reading;
      if (!folder.files.length) throw new Error('No frames of a known format are in it.');
      currentUpload.choose(folder, toId(folder.name));
    } catch (error) {
      currentUpload.choose(undefined, '', toApiError(error));
    }
  }

  private settings(): ImportSettings {
    const data = new FormData(this.form);
    const text = (name: string) => String(data.get(name) ?? '').trim();
    return {
      framesPerSecond: Number(text('fps')) || undefined,
      vertexScale: Number(text('scale')) || undefined,
      up: text('up') || undefined,
      pattern: text('pattern') || undefined,
      allowGaps: data.has('gaps'),
    };
  }

  private async onSubmit(event: Event): Promise<void> {
    event.preventDefault();
    if (!isId(currentUpload.value.animationId)) {
      return currentUpload.refuse(new ApiError(400, `The name may have ${idRule}.`));
    }
    const arrived = await currentUpload.begin(this.settings());
    if (arrived && this.isConnected) this.dispatchEvent(new CustomEvent('uploaded'));
  }
}
