// All animations: how they were imported, what the import noted, and how to delete them.
import { LitElement, css, html, nothing } from 'lit';
import { customElement, query, state } from 'lit/decorators.js';
import { repeat } from 'lit/directives/repeat.js';
import { timestampMs } from '@bufbuild/protobuf/wkt';
import { catalog, type CatalogState } from '../api/catalog.ts';
import { deleteResource } from '../api/changes.ts';
import { toApiError, type ApiError } from '../api/errors.ts';
import { shortName } from '../api/names.ts';
import '../base/error_message.ts';
import { textOf } from '../base/events.ts';
import { formatBytes, formatCount, formatDate, formatSeconds } from '../base/format.ts';
import { Observing } from '../base/observing.ts';
import { controls } from '../base/styles.ts';
import { Animation_State, Up, type Animation } from '../generated/liquidblend/v1/liquidblend_pb.ts';
import './confirm.ts';
import type { Confirm } from './confirm.ts';
import { jobsStyles } from './jobs_styles.ts';
import type { Figure } from './words.ts';

const maxShown = 200;

const states: Record<Animation_State, { kind: string; text: string }> = {
  [Animation_State.STATE_UNSPECIFIED]: { kind: 'none', text: 'unknown' },
  [Animation_State.IMPORTING]: { kind: 'running', text: 'importing' },
  [Animation_State.READY]: { kind: 'good', text: 'ready' },
  [Animation_State.FAILED]: { kind: 'failed', text: 'failed' },
};

function upText(up: Up): string {
  if (!up) return 'z (assumed)';
  return Up[up]!.replace('MINUS_', '-').toLowerCase();
}

function figuresOf(animation: Animation): Figure[] {
  const { numFrames, framesPerSecond, meanEdgeLengthM, numVertices } = animation;
  return [
    { name: 'frames', value: `${numFrames} from ${animation.firstFrameNumber}` },
    { name: 'rate', value: `${framesPerSecond} a second` },
    { name: 'length', value: formatSeconds(Math.max(0, numFrames - 1) / framesPerSecond) },
    {
      name: 'vertices a frame',
      value: formatCount(Math.round(Number(numVertices) / Math.max(1, numFrames))),
    },
    { name: 'mean edge', value: `${meanEdgeLengthM.toPrecision(3)} m` },
    { name: 'up', value: upText(animation.up) },
    { name: 'stored', value: formatBytes(Number(animation.sizeBytes)) },
  ];
}

@customElement('lb-animations')
export class AnimationsView extends LitElement {
  static override styles = [
    controls,
    jobsStyles,
    css`
      .card { gap: 8px; padding: 12px 16px; }
      .notes { margin: 8px 0 0; padding-left: 18px; font-size: 13px; overflow-wrap: anywhere; }
    `,
  ];

  @state() private search = '';
  @state() private lists: CatalogState = catalog.value;
  @state() private errors = new Map<string, ApiError>();
  @query('lb-confirm') private confirm!: Confirm;
  readonly observing = new Observing(this, () => catalog, (lists) => (this.lists = lists));

  override render() {
    const { animations, loading } = this.lists;
    const wanted = this.search.trim().toLowerCase();
    const found = animations.filter(({ name }) => shortName(name).toLowerCase().includes(wanted));
    return html`
      <div class="view">
        ${animations.length > 10 ? this.renderSearch() : nothing}
        <ul class="plain" aria-label="Imported animations">
          ${repeat(
            found.slice(0, maxShown),
            ({ name }) => name,
            (animation) => html`<li>${this.renderAnimation(animation)}</li>`,
          )}
        </ul>
        ${found.length > maxShown
          ? html`<p class="hint">${found.length - maxShown} more: search to narrow the list.</p>`
          : nothing}
        ${
          animations.length || loading
            ? nothing
            : html`<p class="card empty">No animations yet. <a href="#jobs?show=upload">Upload
              one.</a></p>`
        }
      </div>
      <lb-confirm></lb-confirm>
    `;
  }

  private renderSearch() {
    return html`<input type="search" aria-label="Search imported animations" placeholder="Search"
      .value=${this.search} @input=${(event: Event) => (this.search = textOf(event))} />`;
  }

  private renderAnimation(animation: Animation) {
    const id = shortName(animation.name);
    const { kind, text } = states[animation.state] ?? states[Animation_State.STATE_UNSPECIFIED];
    const ready = animation.state === Animation_State.READY;
    return html`
      <article class="card" aria-label=${id}>
        <div class="head">
          <span class="title">${id}</span>
          <span class="actions">
            <span class="mark ${kind}">${text}</span>
            ${ready ? html`<a class="button"
              href="#view?animation=${encodeURIComponent(id)}&play=1">View</a>` : nothing}
            <button class="danger" aria-label=${`Delete ${id}`}
              @click=${() => this.askToDelete(animation)}>Delete</button>
          </span>
        </div>
        ${ready ? this.renderFigures(animation) : nothing}
        ${animation.error ? html`<p class="hint">${animation.error.message}</p>` : nothing}
        ${animation.notes.length ? this.renderNotes(animation) : nothing}
        <lb-error .error=${this.errors.get(animation.name)}></lb-error>
      </article>
    `;
  }

  private renderFigures(animation: Animation) {
    const created = animation.createTime && formatDate(timestampMs(animation.createTime));
    return html`<dl class="figures">
      ${figuresOf(animation).map(({ name, value }) => html`<div><dt>${name}</dt><dd>${value}</dd>
      </div>`)}
      ${created ? html`<div><dt>imported</dt><dd>${created}</dd></div>` : nothing}
    </dl>`;
  }

  private renderNotes({ notes }: Animation) {
    return html`<details>
      <summary>${notes.length === 1 ? '1 note' : `${notes.length} notes`} of the import</summary>
      <ul class="notes">${notes.map((note) => html`<li>${note}</li>`)}</ul>
    </details>`;
  }

  private async askToDelete({ name }: Animation): Promise<void> {
    const id = shortName(name);
    const text =
      'Its stored frames are deleted. The files that it was imported from stay where they are.';
    if (!(await this.confirm.ask({ title: `Delete ${id}?`, text, verb: 'Delete' }))) return;
    const errors = new Map(this.errors);
    errors.delete(name);
    try {
      await deleteResource(name);
    } catch (error) {
      errors.set(name, toApiError(error));
    }
    this.errors = errors;
    void catalog.refresh();
  }
}
