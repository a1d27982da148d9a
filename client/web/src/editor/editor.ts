// The editor of correspondences: source and target side by side, and the pairs between them.
import { LitElement, html, nothing } from 'lit';
import { customElement, query, state } from 'lit/decorators.js';
import { repeat } from 'lit/directives/repeat.js';
import { ApiError, toApiError } from '../api/errors.ts';
import { shortName } from '../api/names.ts';
import { token } from '../api/token.ts';
import '../base/error_message.ts';
import { checkedOf, textOf } from '../base/events.ts';
import { pageLocation, type PageLocation } from '../base/hash_location.ts';
import { icons } from '../base/icons.ts';
import '../base/menu.ts';
import { saveBlob } from '../base/save.ts';
import { controls } from '../base/styles.ts';
import { pairOf, type Kind, type Side } from '../pairs/pairs.ts';
import './again_panel.ts';
import { EditPane } from './edit_pane.ts';
import { actOf, isFree } from './editor_keys.ts';
import { editorStyles } from './editor_styles.ts';
import { EditorModel, type EditorPlace } from './model.ts';
import './pair_list.ts';
import './shortcuts.ts';
import type { Shortcuts } from './shortcuts.ts';

const sides: Side[] = ['source', 'target'];

function placeOf({ fields }: PageLocation): EditorPlace {
  const number = (name: string) => Math.max(0, Number(fields.get(name)) || 0);
  const family = fields.get('family');
  return {
    family: family ? `families/${family}` : '',
    target: Math.max(0, Math.round(number('target')) - 1),
    times: { source: number('t'), target: number('t2') },
  };
}

function fieldsOf(model: EditorModel): URLSearchParams {
  const fields = new URLSearchParams();
  if (model.family) fields.set('family', shortName(model.family.name));
  if (model.target) fields.set('target', String(model.target + 1));
  const { source, target } = model.times;
  if (source) fields.set('t', source.toFixed(4));
  if (target) fields.set('t2', target.toFixed(4));
  return fields;
}

@customElement('lb-editor')
export class Editor extends LitElement {
  static override styles = [controls, editorStyles];

  private readonly model = new EditorModel();
  @state() private fileError: ApiError | undefined;
  @query('input[type=file]') private chooser!: HTMLInputElement;
  @query('lb-shortcuts') private shortcuts!: Shortcuts;
  private importsChecks = false;
  private unsubscribes: (() => void)[] = [];

  override connectedCallback(): void {
    super.connectedCallback();
    this.unsubscribes = [
      pageLocation.subscribe((place) => this.read(place)),
      this.model.changes.subscribe(() => this.onModel()),
      token.subscribe(() => this.read(pageLocation.value)),
    ];
    this.read(pageLocation.value);
    document.addEventListener('keydown', this.onKey);
  }

  override disconnectedCallback(): void {
    for (const unsubscribe of this.unsubscribes) unsubscribe();
    document.removeEventListener('keydown', this.onKey);
    this.model.close();
    super.disconnectedCallback();
  }

  override render() {
    const { model } = this;
    const { family } = model;
    return html`
      <div class="top">
        <h2>${family ? shortName(family.name) : 'Editor'}</h2>
        ${family ? this.renderTools() : nothing}
      </div>
      ${
        family?.version
          ? html`<div class="panes">
              ${repeat(
                sides,
                (side) => side,
                (side) => html`<lb-edit-pane .model=${model} .side=${side}></lb-edit-pane>`,
              )}
            </div>
            <div class="side">
              ${model.error ? html`<lb-error .error=${model.error}></lb-error>` : nothing}
              <lb-again .model=${model}></lb-again>
              <lb-pairs .model=${model}></lb-pairs>
            </div>`
          : html`<div class="empty">
            ${model.error ? nothing : html`<p>Choose a family from the lists to mark what belongs
              together in it.</p>`}
            <lb-error .error=${model.error}></lb-error>
          </div>`
      }
      <lb-shortcuts></lb-shortcuts>
    `;
  }

  private renderTools() {
    const { model } = this;
    return html`
      ${this.renderTargets()}
      <div class="group" role="group" aria-label="New pairs">
        <select aria-label="Kind of new pairs" @change=${this.onKind}>
          ${(['POINT', 'TRAJECTORY', 'SPACE'] as Kind[]).map(
            (kind) =>
              html`<option value=${kind}
                .selected=${kind === model.habit.kind}>${kind.toLowerCase()}</option>`,
          )}
        </select>
        ${this.renderHabit('hard', 'Hard')} ${this.renderHabit('check', 'Check pair')}
      </div>
      <div class="spacer"></div>
      <lb-error .error=${this.fileError}></lb-error>
      <div class="group">
        <label><input type="checkbox" .checked=${model.oneCamera}
          @change=${(event: Event) => model.setOneCamera(checkedOf(event))} /> One camera</label>
        <button ?disabled=${!model.pairs.canUndo} title="Undo (Ctrl+Z)"
          @click=${() => model.pairs.undo()}>Undo</button>
        <button ?disabled=${!model.pairs.canRedo} title="Do again (Ctrl+Shift+Z)"
          @click=${() => model.pairs.redo()}>Redo</button>
        ${this.renderFiles()}
        <button class="icon-button" aria-label="Fit into view" title="Fit into view (f)"
          @click=${() => model.fit()}>
          ${icons.reset}
        </button>
        <button class="icon-button" aria-label="Keys" title="Keys (?)"
          @click=${() => this.shortcuts.open()}>
          ${icons.help}
        </button>
      </div>
    `;
  }

  private renderTargets() {
    const { family, target } = this.model;
    if (!family || family.targets.length < 2) return nothing;
    const choose = (event: Event) =>
      this.model.setTarget(Number(textOf(event)));
    return html`<select aria-label="Target" @change=${choose}>
      ${family.targets.map(
        (name, index) =>
          html`<option value=${index} .selected=${index === target}>${shortName(name)}</option>`,
      )}
    </select>`;
  }

  private renderHabit(which: 'hard' | 'check', name: string) {
    const on = this.model.habit[which];
    return html`<button aria-pressed=${on ? 'true' : 'false'}
      @click=${() => this.model.setHabit({ [which]: !on })}>
      ${name}
    </button>`;
  }

  private renderFiles() {
    return html`
      <input type="file" accept=".json,application/json" aria-label="File of pairs" hidden
        @change=${this.onFile} />
      <lb-menu label="File">
        <button @click=${() => this.choose(false)}>Import pairs</button>
        <button @click=${() => this.export(false)}>Export pairs</button>
        <button @click=${() => this.choose(true)}>Import check pairs</button>
        <button @click=${() => this.export(true)}>Export check pairs</button>
      </lb-menu>
    `;
  }

  override updated(): void {
    const { family } = this.model;
    document.title = `${family ? `${shortName(family.name)}, ` : ''}editor - liquidblend`;
  }

  private onKind(event: Event): void {
    this.model.setHabit({ kind: textOf(event) as Kind });
  }

  private read(place: PageLocation): void {
    if (place.section === 'edit') void this.model.open(placeOf(place));
  }

  private onModel(): void {
    this.requestUpdate();
    if (this.model.family) pageLocation.replace({ section: 'edit', fields: fieldsOf(this.model) });
  }

  private choose(checks: boolean): void {
    this.importsChecks = checks;
    this.chooser.click();
  }

  private async onFile(): Promise<void> {
    const file = this.chooser.files?.[0];
    this.chooser.value = '';
    if (!file) return;
    this.fileError = undefined;
    try {
      this.model.pairs.importFile(await file.text(), file.name, this.importsChecks);
    } catch (error) {
      this.fileError = toApiError(error);
    }
  }

  private export(checks: boolean): void {
    const text = this.model.pairs.exportFile(checks);
    const name = `${shortName(this.model.family!.name)}_${checks ? 'check_pairs' : 'pairs'}.json`;
    saveBlob(new Blob([text], { type: 'application/json' }), name);
  }

  private readonly onKey = (event: KeyboardEvent) => {
    if (event.key === '?' && isFree(event)) this.shortcuts.open();
    const act = this.model.family && actOf(event);
    if (!act) return;
    event.preventDefault();
    const { selected } = this.model;
    const pane = event.composedPath().find((element) => element instanceof EditPane);
    act(this.model);
    if (pane && !pairOf(this.model.list, selected)) void this.keepFocus(pane);
  };

  // A marker that is gone leaves the focus to its picture.
  private async keepFocus(pane: EditPane): Promise<void> {
    await this.updateComplete;
    await pane.updateComplete;
    if (document.activeElement === document.body) pane.focusPicture();
  }
}
