// The lists of families and animations, with search.
import { LitElement, css, html, nothing } from 'lit';
import { customElement, property, state } from 'lit/decorators.js';
import { repeat } from 'lit/directives/repeat.js';
import { catalog, type CatalogState } from '../api/catalog.ts';
import '../base/error_message.ts';
import { icons } from '../base/icons.ts';
import { formatSeconds } from '../base/format.ts';
import { Observing } from '../base/observing.ts';
import { controls } from '../base/styles.ts';
import {
  Animation_State,
  type Animation,
  type Family,
} from '../generated/liquidblend/v1/liquidblend_pb.ts';
import { gradeOf, type GradeMark } from './grade.ts';

const maxRows = 200;

interface Row {
  name: string;
  title: string;
  about: string;
  mark?: GradeMark | undefined;
  disabled: boolean;
}

function titleOf(name: string): string {
  return name.slice(name.indexOf('/') + 1);
}

function familyRow(family: Family): Row {
  const count = family.targets.length + 1;
  const about = family.version
    ? `${count} animations, ${formatSeconds(family.durationS)}, version ${family.version}`
    : 'not registered yet';
  const disabled = !family.version;
  return { name: family.name, title: titleOf(family.name), about, mark: gradeOf(family), disabled };
}

function animationRow(animation: Animation): Row {
  const ready = animation.state === Animation_State.READY;
  const about = ready
    ? `${animation.numFrames} frames at ${animation.framesPerSecond} a second`
    : (animation.error?.message ?? 'being imported');
  return { name: animation.name, title: titleOf(animation.name), about, disabled: !ready };
}

/** Tells of a choice by the event `choose`, whose detail is the resource's name. */
@customElement('lb-catalog')
export class CatalogList extends LitElement {
  static override styles = [
    controls,
    css`
      :host {
        display: flex;
        flex-direction: column;
        gap: 12px;
        min-height: 0;
      }
      .search {
        display: flex;
        gap: 8px;
      }
      .search input {
        flex: 1;
        min-width: 0;
      }
      .lists {
        overflow-y: auto;
        min-height: 0;
        padding: 2px;
      }
      h2 {
        display: flex;
        justify-content: space-between;
        margin: 8px 4px 6px;
        font-size: 12px;
        font-weight: 600;
        color: var(--muted);
      }
      ul {
        list-style: none;
        margin: 0 0 12px;
        padding: 0;
        display: grid;
        gap: 2px;
      }
      li button {
        width: 100%;
        text-align: left;
        border-color: transparent;
        background: none;
        display: grid;
        grid-template-columns: 1fr auto;
        gap: 0 8px;
        align-items: center;
        padding: 6px 8px;
      }
      li button:hover:not(:disabled) {
        background: var(--raised);
        border-color: transparent;
      }
      li button[aria-current='true'] {
        background: var(--accent-soft);
      }
      .title {
        font-weight: 600;
        overflow-wrap: anywhere;
      }
      .about {
        grid-column: 1 / -1;
        font-size: 12px;
        color: var(--muted);
        overflow-wrap: anywhere;
      }
      .mark {
        font-size: 11px;
        padding: 1px 7px;
        border-radius: 9px;
        border: 1px solid currentColor;
      }
      .mark.good {
        color: var(--good);
      }
      .mark.doubtful {
        color: var(--warn);
      }
      .mark.bad {
        color: var(--bad);
      }
      p {
        margin: 4px;
        color: var(--muted);
      }
    `,
  ];

  /** The resource that is shown. */
  @property() current = '';
  @state() private lists: CatalogState = catalog.value;
  @state() private search = '';
  readonly observing = new Observing(this, () => catalog, (lists) => (this.lists = lists));

  override render() {
    return html`
      <div class="search">
        <input
          type="search"
          aria-label="Search families and animations"
          placeholder="Search"
          .value=${this.search}
          @input=${(event: Event) => (this.search = (event.target as HTMLInputElement).value)}
        />
        <button
          aria-label="Read the lists again"
          title="Read the lists again"
          @click=${() => catalog.refresh()}
        >
          ${icons.refresh}
        </button>
      </div>
      ${this.lists.error ? html`<lb-error .error=${this.lists.error}></lb-error>` : nothing}
      <div class="lists">
        ${this.renderList('Families', this.lists.families.map(familyRow))}
        ${this.renderList('Animations', this.lists.animations.map(animationRow))}
      </div>
    `;
  }

  private renderList(title: string, all: Row[]) {
    const wanted = this.search.trim().toLowerCase();
    const rows = all.filter((row) => row.title.toLowerCase().includes(wanted));
    return html`
      <h2><span>${title}</span><span>${rows.length}</span></h2>
      <ul aria-label=${title}>
        ${repeat(
          rows.slice(0, maxRows),
          (row) => row.name,
          (row) => this.renderRow(row),
        )}
      </ul>
      ${
        rows.length > maxRows
          ? html`<p>${rows.length - maxRows} more; search to narrow the list.</p>`
          : nothing
      }
      ${rows.length || this.lists.loading ? nothing : html`<p>None${wanted ? ' of this name' : ' yet'}.</p>`}
    `;
  }

  private renderRow(row: Row) {
    return html`<li>
      <button
        aria-current=${row.name === this.current ? 'true' : 'false'}
        ?disabled=${row.disabled}
        @click=${() => this.dispatchEvent(new CustomEvent('choose', { detail: row.name }))}
      >
        <span class="title">${row.title}</span>
        ${row.mark ? html`<span class="mark ${row.mark.kind}">${row.mark.text}</span>` : nothing}
        <span class="about">${row.about}</span>
      </button>
    </li>`;
  }
}
