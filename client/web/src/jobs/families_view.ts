// All families, and the verdicts, versions and actions of the one that is open.
import { LitElement, css, html, nothing } from 'lit';
import { customElement, property, query, state } from 'lit/decorators.js';
import { timestampMs } from '@bufbuild/protobuf/wkt';
import { catalog, type CatalogState } from '../api/catalog.ts';
import { deleteResource, registerFamily, rollbackFamily } from '../api/changes.ts';
import { isAbort, toApiError, type ApiError } from '../api/errors.ts';
import { shortName } from '../api/names.ts';
import { getFamily } from '../api/resources.ts';
import '../base/error_message.ts';
import { formatBytes, formatCount, formatDate, formatSeconds } from '../base/format.ts';
import { pageLocation } from '../base/hash_location.ts';
import { controls } from '../base/styles.ts';
import type { Family, FamilyVersion } from '../generated/liquidblend/v1/liquidblend_pb.ts';
import { gradeOf } from '../shell/grade.ts';
import './confirm.ts';
import type { Confirm } from './confirm.ts';
import { jobBoard } from './job_board.ts';
import { jobsStyles } from './jobs_styles.ts';
import { refineRequest } from './register_request.ts';
import './verdict_view.ts';
import type { Figure } from './words.ts';

function figuresOf(family: Family): Figure[] {
  const blending = family.timeBlending?.reason;
  return [
    { name: 'version', value: String(family.version) },
    { name: 'source', value: shortName(family.source) },
    { name: 'length', value: formatSeconds(family.durationS) },
    { name: 'space-time vertices', value: formatCount(Number(family.numVertices)) },
    { name: 'stored', value: formatBytes(Number(family.sizeBytes)) },
    ...(family.restoredVersion
      ? [{ name: 'is again version', value: String(family.restoredVersion) }]
      : []),
    ...(blending ? [{ name: 'times', value: blending }] : []),
  ];
}

@customElement('lb-families')
export class FamiliesView extends LitElement {
  static override styles = [
    controls,
    jobsStyles,
    css`
      .choice { display: flex; flex-wrap: wrap; gap: 8px; }
      .choice a[aria-current='true'] { background: var(--accent-soft); border-color: var(--accent);
        }
      lb-verdict + lb-verdict { padding-top: 14px; border-top: 1px solid var(--line); }
      .verdicts { display: grid; gap: 14px; }
      input.iterations { width: 76px; }
    `,
  ];

  /** families/{id} of the one that is open; empty: none. */
  @property() current = '';
  @state() private lists: CatalogState = catalog.value;
  @state() private family: Family | undefined;
  @state() private error: ApiError | undefined;  // of what the person did
  @state() private loadError: ApiError | undefined;
  @state() private refining = false;
  @query('lb-confirm') private confirm!: Confirm;
  private loading = new AbortController();
  private unsubscribe = () => {};

  override connectedCallback(): void {
    super.connectedCallback();
    this.unsubscribe = catalog.subscribe((lists) => this.onLists(lists));
  }

  override disconnectedCallback(): void {
    this.unsubscribe();
    this.loading.abort();
    super.disconnectedCallback();
  }

  override willUpdate(changed: Map<PropertyKey, unknown>): void {
    if (changed.has('current')) void this.load(true);
  }

  override render() {
    const { families, loading } = this.lists;
    return html`
      <div class="view">
        ${
          families.length || loading
            ? html`<nav class="choice"
              aria-label="Families">${families.map((family) => this.renderChoice(family))}</nav>`
            : html`<p class="card empty">No families yet. <a href="#jobs?show=register">Register
              one.</a></p>`
        }
        <lb-error .error=${this.error ?? this.loadError}></lb-error>
        ${this.family ? this.renderFamily(this.family) : nothing}
      </div>
      <lb-confirm></lb-confirm>
    `;
  }

  private renderChoice(family: Family) {
    const id = shortName(family.name);
    const mark = gradeOf(family);
    const open = family.name === this.current;
    return html`<a class="button" href="#jobs?show=families&family=${encodeURIComponent(id)}"
      aria-current=${open ? 'true' : 'false'}>${id}${mark ? `: ${mark.text}` : ''}</a>`;
  }

  private renderFamily(family: Family) {
    const id = encodeURIComponent(shortName(family.name));
    return html`
      <section class="card" aria-label=${shortName(family.name)}>
        <div class="head">
          <h2 class="title">${shortName(family.name)}</h2>
          <span class="actions">
            <a class="button" href="#view?family=${id}&play=1">View</a>
            <a class="button" href="#edit?family=${id}">Mark pairs</a>
            <button class="danger" @click=${() => this.askToDelete(family)}>Delete</button>
          </span>
        </div>
        ${family.version ? this.renderFigures(family) : html`<p class="muted">Not registered
          yet.</p>`}
        ${this.renderFailure(family)}
      </section>
      ${
        family.reports.length
          ? html`<section class="card" aria-label="Verdicts">
            <h2>Verdicts</h2>
            <div class="verdicts">
              ${family.reports.map((report) => html`<lb-verdict .family=${family}
                .report=${report}></lb-verdict>`)}
            </div>
          </section>`
          : nothing
      }
      ${family.version ? this.renderVersions(family) : nothing}
    `;
  }

  private renderFigures(family: Family) {
    return html`<dl class="figures">
      ${figuresOf(family).map(({ name, value }) => html`<div><dt>${name}</dt><dd>${value}</dd>
      </div>`)}
    </dl>`;
  }

  private renderFailure({ failedRegistration }: Family) {
    if (!failedRegistration) return nothing;
    const end = failedRegistration.endTime && formatDate(timestampMs(failedRegistration.endTime));
    const message = failedRegistration.error?.message ?? 'it ended without a version';
    return html`<p class="hint">The newest registration failed${end ? ` (${end})` : ''}:
      ${message}</p>`;
  }

  private renderVersions(family: Family) {
    return html`<section class="card" aria-label="Versions">
      <h2>Versions</h2>
      <form class="actions" @submit=${(event: Event) => this.refine(event, family)}>
        <label class="check">Iterations
          <input class="iterations" name="iterations" type="number" min="1" max="200"
            placeholder="6" />
        </label>
        <button ?disabled=${this.refining}>Refine</button>
        <span class="hint">goes on from version ${family.version} with the same pairs</span>
      </form>
      ${
        family.keptVersions.length
          ? html`<div class="scroll"><table>
            <thead><tr><th scope="col">Version</th><th scope="col">Published</th>
            <th scope="col">Stored</th><td></td></tr></thead>
            <tbody>${family.keptVersions.map((kept) => this.renderVersion(family, kept))}</tbody>
          </table></div>`
          : html`<p class="hint">No version before this one is kept.</p>`
      }
    </section>`;
  }

  private renderVersion(family: Family, { version, publishTime, sizeBytes }: FamilyVersion) {
    const id = encodeURIComponent(shortName(family.name));
    const half = family.targets.map(() => 0.5).join(',');
    return html`<tr>
      <td class="number">${version}</td>
      <td>${publishTime ? formatDate(timestampMs(publishTime)) : ''}</td>
      <td class="number">${formatBytes(Number(sizeBytes))}</td>
      <td>
        <span class="actions">
          <a class="button"
            href="#view?family=${id}&beside=version.${version}&w=${half}&play=1"
            >Compare</a>
          <button @click=${() => this.rollBack(family, version)}>Publish again</button>
        </span>
      </td>
    </tr>`;
  }

  private onLists(lists: CatalogState): void {
    const stamp = (state: CatalogState) =>
      JSON.stringify(state.families.map((f) => [f.name, String(f.version)]));
    const changed = stamp(lists) !== stamp(this.lists);
    this.lists = lists;
    if (changed) void this.load(false);
  }

  // Lists have no kept versions: reads the family by itself.
  private async load(clear: boolean): Promise<void> {
    this.loading.abort();
    const { signal } = (this.loading = new AbortController());
    if (clear) this.family = this.error = this.loadError = undefined;
    if (!this.current) return;
    try {
      const family = await getFamily(this.current, 0n, signal);
      if (signal.aborted) return;
      this.family = family;
      this.loadError = undefined;
    } catch (error) {
      if (!isAbort(error)) this.loadError = toApiError(error);
    }
  }

  private async refine(event: Event, family: Family): Promise<void> {
    event.preventDefault();
    if (this.refining) return;
    this.refining = true;
    const iterations = Number(new FormData(event.target as HTMLFormElement).get('iterations'));
    await this.attempt(async () => {
      jobBoard.add(await registerFamily(refineRequest(family, iterations)));
      pageLocation.go({ section: 'jobs', fields: new URLSearchParams({ show: 'operations' }) });
    });
    this.refining = false;
  }

  private async rollBack(family: Family, version: bigint): Promise<void> {
    const title = `Publish version ${version} again?`;
    const name = shortName(family.name);
    const text =
      `It becomes the newest version of ${name}, with a number of its own. ` +
      `Version ${family.version} is kept beside it.`;
    if (!(await this.confirm.ask({ title, text, verb: 'Publish' }))) return;
    await this.attempt(async () => {
      this.family = await rollbackFamily(family.name, version);
    });
    void catalog.refresh();
    void this.load(false);
  }

  private async askToDelete({ name }: Family): Promise<void> {
    const title = `Delete ${shortName(name)}?`;
    const text = 'All of its versions are deleted. Its animations stay.';
    if (!(await this.confirm.ask({ title, text, verb: 'Delete' }))) return;
    await this.attempt(async () => {
      await deleteResource(name);
      pageLocation.go({ section: 'jobs', fields: new URLSearchParams({ show: 'families' }) });
    });
    void catalog.refresh();
  }

  private async attempt(action: () => Promise<void>): Promise<void> {
    this.error = undefined;
    try {
      await action();
    } catch (error) {
      this.error = toApiError(error);
    }
  }
}
