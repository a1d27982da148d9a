// All operations: those that run first.
import { LitElement, html, nothing } from 'lit';
import { customElement, state } from 'lit/decorators.js';
import { repeat } from 'lit/directives/repeat.js';
import type { Job } from '../api/operations.ts';
import { Observing } from '../base/observing.ts';
import '../base/error_message.ts';
import { controls } from '../base/styles.ts';
import { jobBoard, type BoardState } from './job_board.ts';
import './job_card.ts';
import { jobsStyles } from './jobs_styles.ts';

@customElement('lb-operations')
export class OperationsView extends LitElement {
  static override styles = [controls, jobsStyles];

  @state() private board: BoardState = jobBoard.value;
  readonly observing = new Observing(this, () => jobBoard, (board) => (this.board = board));

  override render() {
    const { jobs, error, hasMore, loading } = this.board;
    const running = jobs.filter((job) => job.state === 'running');
    const ended = jobs.filter((job) => job.state !== 'running');
    return html`
      <div class="view">
        <lb-error .error=${error}></lb-error>
        ${this.renderList('Running', running)} ${this.renderList('Ended', ended)}
        ${jobs.length || loading ? nothing : html`<p class="card empty">Nothing has been imported or
          registered yet.</p>`}
        ${hasMore ? html`<div><button @click=${() => jobBoard.more()}>Older
          ones</button></div>` : nothing}
      </div>
    `;
  }

  private renderList(title: string, jobs: Job[]) {
    if (!jobs.length) return nothing;
    return html`
      <h2>${title}</h2>
      <ul class="plain" aria-label=${title}>
        ${repeat(
          jobs,
          (job) => job.name,
          (job) => html`<li><lb-job .job=${job}></lb-job></li>`,
        )}
      </ul>
    `;
  }
}
