// One operation: what it does, how far it is, how it ended.
import { LitElement, css, html, nothing } from 'lit';
import { customElement, property, state } from 'lit/decorators.js';
import { toApiError, type ApiError } from '../api/errors.ts';
import { shortName } from '../api/names.ts';
import { cancelJob, deleteJob, endOf, type Job, type JobKind } from '../api/operations.ts';
import '../base/error_message.ts';
import { formatDate } from '../base/format.ts';
import { controls } from '../base/styles.ts';
import { jobBoard } from './job_board.ts';
import { jobsStyles } from './jobs_styles.ts';
import { gradeWords, leftText, progressFigures, stageText, stateTexts } from './words.ts';

const kinds: Record<JobKind, string> = {
  import: 'Import',
  registration: 'Registration',
  job: 'Job',
};

@customElement('lb-job')
export class JobCard extends LitElement {
  static override styles = [
    controls,
    jobsStyles,
    css`
      .card { gap: 8px; padding: 12px 16px; }
      .bar { display: grid; gap: 4px; }
      .stage { display: flex; flex-wrap: wrap; justify-content: space-between; gap: 0 12px;
        font-size: 13px; }
      .kind { color: var(--muted); font-weight: 400; }
    `,
  ];

  @property({ attribute: false }) job!: Job;
  @state() private error: ApiError | undefined;
  @state() private cancelling = false;

  override render() {
    const { job } = this;
    return html`
      <article class="card" aria-label=${`${kinds[job.kind]} of ${shortName(job.subject)}`}>
        <div class="head">
          <span class="title"><span class="kind">${kinds[job.kind]}</span>
            ${shortName(job.subject)}</span>
          <span class="actions">
            ${this.renderGrade()}
            <span class="mark ${job.state}">${stateTexts[job.state]}</span>
            ${this.renderActions()}
          </span>
        </div>
        ${job.state === 'running' ? this.renderProgress() : this.renderEnd()}
        <lb-error .error=${this.error ?? job.error}></lb-error>
      </article>
    `;
  }

  private renderGrade() {
    const { job } = this;
    if (job.kind !== 'registration' || job.state !== 'done' || !job.grade) return nothing;
    const { kind, title } = gradeWords(job.grade);
    return html`<span class="mark ${kind}">${title}</span>`;
  }

  private renderActions() {
    const { job } = this;
    if (job.state === 'running') {
      return html`<button ?disabled=${this.cancelling} @click=${this.cancel}>
        ${this.cancelling ? 'Cancelling' : 'Cancel'}
      </button>`;
    }
    const family = job.kind === 'registration';
    const id = encodeURIComponent(shortName(job.subject));
    return html`
      ${
        job.state === 'done' && job.subject
          ? html`<a class="button"
            href="#view?${family ? 'family' : 'animation'}=${id}&play=1">View</a>`
          : nothing
      }
      ${
        job.state === 'done' && family
          ? html`<a class="button" href="#jobs?show=families&family=${id}">Verdict</a>`
          : nothing
      }
      <button aria-label="Remove from the list" title="Remove from the list"
        @click=${this.forget}>Remove</button>
    `;
  }

  private renderProgress() {
    const { progress } = this.job;
    const fraction = progress?.fraction ?? 0;
    return html`
      <div class="bar">
        <div class="stage">
        <span>${stageText(progress)}</span><span>${leftText(progress)}</span></div>
        <progress max="1" .value=${fraction}
          aria-label=${`Progress of ${shortName(this.job.subject)}`}></progress>
      </div>
      ${this.renderFigures()}
      ${progress?.waitingFor ? html`<p class="hint">Waiting: ${progress.waitingFor}</p>` : nothing}
      ${
        progress?.lastFailure?.message
          ? html`<p class="hint">Tried again after: ${progress.lastFailure.message}</p>`
          : nothing
      }
    `;
  }

  private renderEnd() {
    const end = endOf(this.job);
    const { version } = this.job;
    return html`<dl class="figures">
      ${end ? html`<div><dt>ended</dt><dd>${formatDate(end)}</dd></div>` : nothing}
      ${version ? html`<div><dt>version</dt><dd>${version}</dd></div>` : nothing}
      ${this.figures()}
    </dl>`;
  }

  private renderFigures() {
    return html`<dl class="figures">${this.figures()}</dl>`;
  }

  private figures() {
    return progressFigures(this.job.progress).map(
      ({ name, value }) => html`<div><dt>${name}</dt><dd>${value}</dd></div>`,
    );
  }

  private async cancel(): Promise<void> {
    this.cancelling = true;
    await this.attempt(() => cancelJob(this.job.name));
  }

  private async forget(): Promise<void> {
    const { name } = this.job;
    if (await this.attempt(() => deleteJob(name))) jobBoard.forget(name);
  }

  private async attempt(action: () => Promise<void>): Promise<boolean> {
    this.error = undefined;
    try {
      await action();
      return true;
    } catch (error) {
      this.error = toApiError(error);
      this.cancelling = false;
      return false;
    }
  }
}
