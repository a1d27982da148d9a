// The verdict on one target: grade, reason, figures, and the way to its worst place.
import { LitElement, css, html, nothing } from 'lit';
import { customElement, property } from 'lit/decorators.js';
import { shortName } from '../api/names.ts';
import { pageLocation } from '../base/hash_location.ts';
import { controls } from '../base/styles.ts';
import {
  Verdict_Grade,
  type Event as PlaceAndTime,
  type Family,
  type RegistrationReport,
} from '../generated/liquidblend/v1/liquidblend_pb.ts';
import { jobsStyles } from './jobs_styles.ts';
import { reportFigures, verdictFigures, type VerdictFigure } from './verdict_words.ts';
import { gradeWords } from './words.ts';

function placeText({ position, timeS }: PlaceAndTime): string {
  const { x = 0, y = 0, z = 0 } = position ?? {};
  return `(${[x, y, z].map((value) => value.toFixed(3)).join(', ')}) m at ${timeS.toFixed(2)} s`;
}

@customElement('lb-verdict')
export class VerdictView extends LitElement {
  static override styles = [
    controls,
    jobsStyles,
    css`
      :host { display: grid; gap: 10px; }
      .reason { overflow-wrap: anywhere; }
      table { font-size: 13px; }
      td.meaning { color: var(--muted); }
    `,
  ];

  @property({ attribute: false }) family!: Family;
  @property({ attribute: false }) report!: RegistrationReport;

  override render() {
    const { report } = this;
    const { verdict } = report;
    const words = gradeWords(verdict?.grade ?? Verdict_Grade.GRADE_UNSPECIFIED);
    return html`
      <div class="head">
        <span class="title">${shortName(report.target)}</span>
        <span class="mark ${words.kind}">${words.title}</span>
      </div>
      <p>${words.text}</p>
      ${verdict?.reason ? html`<p class="reason muted">${verdict.reason}</p>` : nothing}
      ${
        verdict?.worst?.position
          ? html`<div class="actions">
            <button @click=${this.fly}>Go to the worst place</button>
            <span class="hint">${placeText(verdict.worst)}</span>
          </div>`
          : nothing
      }
      <details>
        <summary>All figures</summary>
        <div class="scroll">${this.renderFigures()}</div>
      </details>
    `;
  }

  private renderFigures() {
    const { verdict, hypotheses } = this.report;
    const figures = [...(verdict ? verdictFigures(verdict) : []), ...reportFigures(this.report)];
    const tried: VerdictFigure[] = hypotheses.map(({ pairing, cost, isKept }) => ({
      name: `Tried: ${pairing}`,
      value: cost.toPrecision(3),
      meaning: isKept ? 'cost; kept' : 'cost',
    }));
    return html`<table>
      <caption class="visually-hidden">Figures of ${shortName(this.report.target)}</caption>
      <tbody>${[...figures, ...tried].map(
        ({ name, value, meaning }) => html`<tr>
        <th scope="row">${name}</th><td class="number">${value}</td>
        <td class="meaning">${meaning}</td>
      </tr>`,
      )}</tbody>
    </table>`;
  }

  private async fly(): Promise<void> {
    const { worstPlace } = await import('./worst_place.ts');
    const fields = worstPlace(this.family, this.report);
    if (fields) pageLocation.go({ section: 'view', fields });
  }
}
