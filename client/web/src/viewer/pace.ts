// How it plays: speed, frames a second, loop and its range.
import { LitElement, css, html, nothing } from 'lit';
import { customElement, property } from 'lit/decorators.js';
import { clamp, roundTo } from '../base/numbers.ts';
import { Observing } from '../base/observing.ts';
import { controls } from '../base/styles.ts';
import type { Loop } from '../stream/clock.ts';
import type { ViewModel } from '../view/model.ts';

const rates = [0.1, 0.25, 0.5, 1, 2, 4];
const frameRates = [24, 30, 60, 120];
const loops: [Loop, string][] = [
  ['off', 'Once'],
  ['whole', 'Loop all'],
  ['range', 'Loop range'],
];

function withValue(values: number[], value: number): number[] {
  return values.includes(value) ? values : [...values, value].sort((a, b) => a - b);
}

@customElement('lb-pace')
export class Pace extends LitElement {
  static override styles = [
    controls,
    css`
      :host {
        display: flex;
        flex-wrap: wrap;
        gap: 8px;
        align-items: center;
      }
      label {
        display: flex;
        gap: 6px;
        align-items: center;
      }
      input[type='number'] {
        width: 84px;
        font: 13px var(--mono);
      }
    `,
  ];

  @property({ attribute: false }) model!: ViewModel;
  readonly observing = new Observing(this, () => this.model.changes);

  override render() {
    const { rate, framesPerSecond, loop } = this.model.state;
    const own = this.model.main?.info?.timing.framesPerSecond;
    return html`
      <select
        aria-label="Speed"
        title="Speed"
        @change=${(event: Event) => this.model.patch({ rate: numberOf(event) })}
      >
        ${withValue(rates, rate).map(
          (value) => html`<option value=${value} .selected=${value === rate}>${value} ×</option>`,
        )}
      </select>
      <select
        aria-label="Loop"
        title="Loop (l)"
        @change=${(event: Event) => this.model.setLoop(textOf(event) as Loop)}
      >
        ${loops.map(([value, name]) => html`<option value=${value} .selected=${value === loop}>${name}</option>`)}
      </select>
      ${loop === 'range' ? this.renderRange() : nothing}
      <select
        aria-label="Frames per second"
        title="Frames per second"
        @change=${(event: Event) => this.model.patch({ framesPerSecond: numberOf(event) })}
      >
        <option value="0" .selected=${framesPerSecond === 0}>
          ${own ? `${own} frames/s (its own)` : 'its own'}
        </option>
        ${withValue(frameRates, framesPerSecond || 60).map(
          (value) =>
            html`<option value=${value} .selected=${value === framesPerSecond}>
              ${value} frames/s
            </option>`,
        )}
      </select>
    `;
  }

  private renderRange() {
    const [from, to] = this.model.state.range;
    return html`
      <label>from ${this.renderBound('Begin of the range', from, (value) => [value, to])}</label>
      <label>to ${this.renderBound('End of the range', to, (value) => [from, value])}</label>
    `;
  }

  private renderBound(name: string, value: number, change: (value: number) => [number, number]) {
    const duration = this.model.main?.info?.timing.durationS ?? 0;
    const set = (event: Event) => {
      const entered = (event.target as HTMLInputElement).valueAsNumber;
      if (!Number.isFinite(entered)) return;
      this.model.patch({ range: change(roundTo(clamp(entered, 0, duration), 4)) });
    };
    return html`<input
      type="number"
      aria-label=${name}
      min="0"
      max=${duration}
      step="any"
      .value=${String(value)}
      @change=${set}
    />`;
  }
}

function textOf(event: Event): string {
  return (event.target as HTMLSelectElement).value;
}

function numberOf(event: Event): number {
  return Number(textOf(event));
}
