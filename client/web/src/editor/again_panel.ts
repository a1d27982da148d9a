// "Register again": refines with the pairs, shows progress, then what became of each pair.
import { LitElement, css, html, nothing } from 'lit';
import { customElement, property, query, state } from 'lit/decorators.js';
import { toApiError, type ApiError } from '../api/errors.ts';
import { shortName } from '../api/names.ts';
import { cancelJob } from '../api/operations.ts';
import '../base/error_message.ts';
import { checkedOf, textOf } from '../base/events.ts';
import { Observing } from '../base/observing.ts';
import { controls } from '../base/styles.ts';
import { gradeWords, leftText, progressFigures, stageText } from '../jobs/words.ts';
import type { Run } from '../pairs/again.ts';
import type { Residual } from '../pairs/correspondences.ts';
import { sentPairs } from '../pairs/pairs.ts';
import { dropsSome, sentNumbers } from '../pairs/registration.ts';
import type { EditorModel } from './model.ts';

function lengthText(residual: Residual | undefined): string {
  return residual ? `${residual.metres.toFixed(3)} m` : '–';
}

@customElement('lb-again')
export class AgainPanel extends LitElement {
  static override styles = [
    controls,
    css`
      :host { display: grid; gap: 8px; }
      h3 { margin: 0; font-size: 13px; }
      .row { display: flex; flex-wrap: wrap; gap: 6px 10px; align-items: center; font-size: 13px; }
      label { display: inline-flex; gap: 6px; align-items: center; }
      input[type='number'] { width: 72px; }
      progress { appearance: none; width: 100%; height: 8px; border: 0; border-radius: 4px;
        overflow: hidden;
        background: var(--accent-soft); }
      progress::-webkit-progress-bar { background: var(--accent-soft); }
      progress::-webkit-progress-value { background: var(--accent); }
      progress::-moz-progress-bar { background: var(--accent); }
      .stage { display: flex; justify-content: space-between; gap: 8px; font-size: 12px; }
      dl { display: flex; flex-wrap: wrap; gap: 2px 14px; margin: 0; font-size: 12px; }
      dl div { display: flex; gap: 5px; }
      dt { color: var(--muted); }
      dd { margin: 0; font-family: var(--mono); }
      p { margin: 0; font-size: 12px; color: var(--muted); overflow-wrap: anywhere; }
      table { border-collapse: collapse; width: 100%; font-size: 12px; }
      th, td { text-align: right; padding: 3px 6px 3px 0; border-bottom: 1px solid var(--line); }
      th:first-child, td:first-child { text-align: left; }
      td { font-family: var(--mono); }
      th { color: var(--muted); font-weight: 600; }
      .overruled { color: var(--warn); font-weight: 600; }
      .kept { color: var(--good); }
      .good { color: var(--good); } .doubtful { color: var(--warn); } .bad { color: var(--bad); }
      a.button { display: inline-flex; align-items: center; min-height: 32px; padding: 4px 10px;
        border: 1px solid var(--line); border-radius: 6px; background: var(--raised);
        color: var(--text);
        text-decoration: none; }
    `,
  ];

  @property({ attribute: false }) model!: EditorModel;
  @state() private fromScratch = false;
  @state() private cancelError: ApiError | undefined;
  @query('input[type=number]') private iterations!: HTMLInputElement;
  readonly observing = new Observing(this, () => this.model.changes);

  override render() {
    const { model } = this;
    const { busy, run, error } = model.again;
    const { lists } = model.pairs;
    const drops = dropsSome(lists);
    return html`
      <h3>Register again</h3>
      <div class="row">
        <select aria-label="How to register again" @change=${this.onMode}>
          <option value="refine" .selected=${!this.fromScratch}>Refine: for details</option>
          <option value="scratch" .selected=${this.fromScratch}>From scratch: if all is
            wrong</option>
        </select>
        <label>Iterations
          <input type="number" min="1" max="200" placeholder=${this.fromScratch ? '20' : '6'} />
        </label>
        <label>
          <input type="checkbox" .checked=${model.findsPairs && !drops} ?disabled=${drops}
            @change=${(event: Event) => model.set({ findsPairs: checkedOf(event) })} />
          Also find pairs by itself
        </label>
      </div>
      ${
        drops
          ? html`<p>You dropped some of the pairs that were found. The others are sent as your
            own.</p>`
          : nothing
      }
      <div class="row">
        <button class="primary" ?disabled=${busy} @click=${this.onRegister}>
          Register again with ${this.numSent} ${this.numSent === 1 ? 'pair' : 'pairs'}
        </button>
        ${busy && run ? html`<button @click=${() => this.cancel(run)}>Cancel</button>` : nothing}
      </div>
      <lb-error .error=${error ?? this.cancelError ?? run?.job.error}></lb-error>
      ${run?.job.error ? html`<p>Numbers in messages count from 0:
        ${sentNumbers(model.list)}.</p>` : nothing}
      ${run ? this.renderRun(run) : nothing}
    `;
  }

  private get numSent(): number {
    return this.model.pairs.lists.reduce((total, list) => total + sentPairs(list).length, 0);
  }

  private renderRun(run: Run) {
    if (run.job.state === 'running') return this.renderProgress(run);
    return run.job.state === 'done' ? this.renderResult(run) : nothing;
  }

  private renderProgress({ job: { progress } }: Run) {
    return html`
      <div class="stage" role="status">
      <span>${stageText(progress)}</span><span>${leftText(progress)}</span></div>
      <progress max="1" .value=${progress?.fraction ?? 0}
        aria-label="Progress of the registration"></progress>
      <dl>${progressFigures(progress).map(({ name, value }) => html`<div><dt>${name}</dt>
      <dd>${value}</dd></div>`)}</dl>
    `;
  }

  private renderResult({ job, before, versionBefore }: Run) {
    const { family, list } = this.model;
    const { kind, title } = gradeWords(job.grade);
    const id = encodeURIComponent(shortName(family?.name ?? ''));
    const weights = (family?.targets ?? [])
      .map((_, target) => (target === this.model.target ? 0.5 : 0))
      .join(',');
    const beside = `#view?family=${id}&beside=version.${versionBefore}&w=${weights}&play=1`;
    return html`
      <p role="status">Version ${job.version} is published: <span class=${kind}>${title}</span>.</p>
      <div class="row"><a class="button" href=${beside}>Compare versions ${versionBefore} and
        ${job.version}</a></div>
      ${
        list.pairs.length
          ? html`<table aria-label="Pairs before and after">
            <thead><tr><th scope="col">Pair</th><th scope="col">before</th>
            <th scope="col">after</th><td></td></tr></thead>
            <tbody>${list.pairs.map(({ number, check }) =>
              this.renderRow(number, check, before.get(number)),
            )}</tbody>
          </table>`
          : nothing
      }
    `;
  }

  private renderRow(number: number, check: boolean, before: Residual | undefined) {
    const after = this.model.residuals.all.get(number);
    const outcome = check ? 'check' : (after?.outcome ?? '');
    return html`<tr>
      <td>${number}</td><td>${lengthText(before)}</td><td>${lengthText(after)}</td>
      <td class=${outcome}>${outcome}</td>
    </tr>`;
  }

  private onMode(event: Event): void {
    this.fromScratch = textOf(event) === 'scratch';
  }

  private onRegister(): void {
    const iterations = Number(this.iterations.value);
    const { fromScratch } = this;
    this.cancelError = undefined;
    void this.model.registerAgain({ fromScratch, iterations, findPairs: this.model.findsPairs });
  }

  private async cancel({ job }: Run): Promise<void> {
    try {
      await cancelJob(job.name);
    } catch (error) {
      this.cancelError = toApiError(error);
    }
  }
}
