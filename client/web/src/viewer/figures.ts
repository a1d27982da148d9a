// A line of figures about what is shown, four times a second.
import { LitElement, css, html, nothing } from 'lit';
import { customElement, property } from 'lit/decorators.js';
import { formatBytes, formatCount } from '../base/format.ts';
import { controls } from '../base/styles.ts';
import type { Pane } from '../view/panes.ts';

const periodMs = 250;

@customElement('lb-figures')
export class Figures extends LitElement {
  static override styles = [
    controls,
    css`
      :host {
        display: block;
      }
      dl {
        display: flex;
        flex-wrap: wrap;
        gap: 2px 16px;
        margin: 0;
        font-size: 12px;
        line-height: 18px;
        height: 38px;
        overflow: hidden;
        align-content: start;
      }
      div {
        display: flex;
        gap: 5px;
        white-space: nowrap;
      }
      dt {
        color: var(--muted);
      }
      dd {
        margin: 0;
        font-family: var(--mono);
      }
      .mark {
        color: var(--warn);
        font-weight: 600;
        font-family: inherit;
      }
    `,
  ];

  @property({ attribute: false }) pane!: Pane;
  private timer: ReturnType<typeof setInterval> | undefined;

  override connectedCallback(): void {
    super.connectedCallback();
    this.timer = setInterval(() => this.requestUpdate(), periodMs);
  }

  override disconnectedCallback(): void {
    clearInterval(this.timer);
    super.disconnectedCallback();
  }

  override render() {
    const picture = this.pane.picture;
    const shown = picture?.shown;
    if (!picture || !shown) return html`<dl></dl>`;
    const { info, counts, numBytes } = shown;
    const rate = picture.shownRate.perSecond(performance.now());
    const playing = picture.player?.playing ?? false;
    return html`
      <dl aria-label="Figures">
        ${info.extrapolated ? this.mark('extrapolated') : nothing}
        ${info.clamped ? this.mark('clamped') : nothing}
        ${picture.player?.connection === 'waiting' ? this.mark('connection lost, trying again') : nothing}
        ${playing ? this.figure('frames/s', rate.toFixed(0)) : nothing}
        ${this.figure('decode', `${picture.decodeMs.mean.toFixed(1)} ms`)}
        ${this.figure('main thread', `${picture.mainMs.mean.toFixed(1)} ms`)}
        ${this.figure('frame', formatBytes(numBytes))}
        ${playing ? this.figure('stream', `${formatBytes(rate * picture.bytesRate.mean)}/s`) : nothing}
        ${this.figure('vertices', formatCount(counts.vertices))}
        ${info.levelOfDetail ? this.figure('level', String(info.levelOfDetail)) : nothing}
        ${info.weights.length ? this.figure('weights', info.weights.map((w) => w.toFixed(2)).join(', ')) : nothing}
        ${info.frameNumber === undefined ? nothing : this.figure('number', String(info.frameNumber))}
        ${playing && info.numDropped ? this.figure('dropped', String(info.numDropped)) : nothing}
      </dl>
    `;
  }

  private figure(name: string, value: string) {
    return html`<div>
      <dt>${name}</dt>
      <dd>${value}</dd>
    </div>`;
  }

  private mark(text: string) {
    return html`<div>
      <dt class="visually-hidden">note</dt>
      <dd class="mark">${text}</dd>
    </div>`;
  }
}
