// A slider for each weight, from -1 to 2. The zones beyond 0 to 1, which extrapolate, are marked.
import { LitElement, css, html, nothing } from 'lit';
import { customElement, property } from 'lit/decorators.js';
import { roundTo, sum } from '../base/numbers.ts';
import { Observing } from '../base/observing.ts';
import { controls } from '../base/styles.ts';
import type { ViewModel } from '../view/model.ts';
import { weightLimits } from '../view/state.ts';

const step = 0.01;

function isBeyond(weight: number): boolean {
  return weight < 0 || weight > 1;
}

@customElement('lb-weights')
export class Weights extends LitElement {
  static override styles = [
    controls,
    css`
      :host {
        display: grid;
        gap: 14px;
      }
      h3 {
        margin: 0;
        font-size: 13px;
        font-weight: 600;
      }
      .weight {
        display: grid;
        grid-template-columns: 1fr 84px;
        gap: 2px 10px;
        align-items: center;
      }
      .name {
        overflow-wrap: anywhere;
        font-size: 13px;
      }
      .name .role {
        color: var(--muted);
      }
      .slider {
        grid-column: 1 / -1;
      }
      input[type='number'] {
        width: 100%;
        font: 13px var(--mono);
        text-align: right;
      }
      .marks {
        position: relative;
        height: 15px;
        margin: 0 8px;
        font: 11px var(--mono);
        color: var(--muted);
      }
      .marks span {
        position: absolute;
        transform: translateX(-50%);
      }
      .marks .low {
        left: 0;
      }
      .marks .zero {
        left: 33.333%;
      }
      .marks .one {
        left: 66.667%;
      }
      .marks .high {
        left: 100%;
      }
      input[type='range'] {
        width: 100%;
        margin: 0;
        height: 26px;
        appearance: none;
        background: none;
      }
      input[type='range']::-webkit-slider-runnable-track {
        height: 10px;
        border-radius: 5px;
        border: 1px solid var(--control);
        background: var(--zones);
      }
      input[type='range']::-moz-range-track {
        height: 10px;
        border-radius: 5px;
        border: 1px solid var(--control);
        background: var(--zones);
      }
      input[type='range']::-webkit-slider-thumb {
        appearance: none;
        width: 18px;
        height: 18px;
        margin-top: -5px;
        border-radius: 50%;
        background: var(--accent);
        border: 2px solid var(--panel);
        box-shadow: 0 0 0 1px var(--accent);
      }
      input[type='range']::-moz-range-thumb {
        width: 15px;
        height: 15px;
        border-radius: 50%;
        background: var(--accent);
        border: 2px solid var(--panel);
      }
      .beyond input[type='range']::-webkit-slider-thumb {
        background: var(--warn);
        box-shadow: 0 0 0 1px var(--warn);
      }
      .beyond input[type='range']::-moz-range-thumb {
        background: var(--warn);
      }
      .note {
        grid-column: 1 / -1;
        font-size: 12px;
        color: var(--warn);
      }
      .slider {
        --zones: linear-gradient(
          90deg,
          var(--warn-soft) 0 calc(9px + (100% - 18px) / 3),
          var(--accent-soft) 0 calc(9px + (100% - 18px) * 2 / 3),
          var(--warn-soft) 0
        );
      }
      .source {
        display: flex;
        justify-content: space-between;
        gap: 10px;
        font-size: 13px;
        padding-top: 10px;
        border-top: 1px solid var(--line);
      }
      .source .value {
        font: 13px var(--mono);
      }
    `,
  ];

  @property({ attribute: false }) model!: ViewModel;
  readonly observing = new Observing(this, () => this.model.changes);

  override render() {
    const { targets, state } = this.model;
    const source = this.model.main?.info?.family?.source;
    if (!source) return nothing;
    const weights = targets.map((_, index) => state.weights[index] ?? 0);
    const rest = roundTo(1 - sum(weights), 4);
    return html`
      <h3>Weights</h3>
      ${targets.map((target, index) => this.renderWeight(target, weights[index]!, index))}
      <div class="source">
        <span class="name"
          ><span class="role">source</span> ${source.replace('animations/', '')}</span
        >
        <span class="value">${rest.toFixed(2)}</span>
      </div>
    `;
  }

  private renderWeight(target: string, weight: number, index: number) {
    const name = target.replace('animations/', '');
    const set = (event: Event) => {
      const value = (event.target as HTMLInputElement).valueAsNumber;
      if (Number.isFinite(value)) this.model.setWeight(index, value);
    };
    const [low, high] = weightLimits;
    return html`
      <div class="weight ${isBeyond(weight) ? 'beyond' : ''}">
        <span class="name"><span class="role">target</span> ${name}</span>
        <input
          type="number"
          min=${low}
          max=${high}
          step="0.05"
          aria-label=${`Weight of ${name}, number`}
          .value=${String(weight)}
          @change=${set}
        />
        <div class="slider">
          <input
            type="range"
            min=${low}
            max=${high}
            step=${step}
            aria-label=${`Weight of ${name}`}
            .value=${String(weight)}
            @input=${set}
          />
          <div class="marks" aria-hidden="true">
            <span class="low">-1</span><span class="zero">0</span><span class="one">1</span
            ><span class="high">2</span>
          </div>
        </div>
        ${isBeyond(weight) ? html`<span class="note">Beyond the inputs: extrapolated</span>` : nothing}
      </div>
    `;
  }
}
