// Play, pause and scrub. The thumb follows frames, except while a person holds it.
import { LitElement, html, type PropertyValues } from 'lit';
import { customElement, property, query } from 'lit/decorators.js';
import { icons } from '../base/icons.ts';
import { clamp } from '../base/numbers.ts';
import { controls } from '../base/styles.ts';
import type { ViewModel } from '../view/model.ts';
import type { Pane } from '../view/panes.ts';
import { timelineStyles } from './timeline_styles.ts';

@customElement('lb-timeline')
export class Timeline extends LitElement {
  static override styles = [controls, timelineStyles];

  @property({ attribute: false }) model!: ViewModel;
  @property({ attribute: false }) pane!: Pane;
  @query('input') private slider!: HTMLInputElement;
  @query('.readout') private readout!: HTMLElement;
  @query('.range') private range!: HTMLElement;
  private held = false;
  private wanted: number | undefined; // by the pointer, until the next animation frame
  private unsubscribes: (() => void)[] = [];

  override connectedCallback(): void {
    super.connectedCallback();
    this.unsubscribes = [
      this.model.changes.subscribe(() => this.requestUpdate()),
      this.model.times.subscribe((pane) => pane === this.pane && this.follow()),
    ];
  }

  override disconnectedCallback(): void {
    for (const unsubscribe of this.unsubscribes) unsubscribe();
    super.disconnectedCallback();
  }

  override render() {
    const playing = this.pane.picture?.player?.playing ?? false;
    return html`
      <button
        class="play"
        aria-label=${playing ? 'Pause' : 'Play'}
        title=${playing ? 'Pause (space)' : 'Play (space)'}
        @click=${() => this.model.togglePlay(this.pane)}
      >
        ${playing ? icons.pause : icons.play}
      </button>
      <div class="slider">
        <div class="range" aria-hidden="true"></div>
        <input
          type="range"
          min="0"
          step="any"
          aria-label=${`Time of ${this.pane.title}`}
          @pointerdown=${this.onHold}
          @pointerup=${this.onPointerEnd}
          @pointercancel=${this.onPointerEnd}
          @input=${this.onInput}
          @change=${this.onChange}
          @keydown=${this.onKey}
        />
      </div>
      <span class="readout"></span>
    `;
  }

  override updated(_changed: PropertyValues): void {
    this.slider.max = String(this.duration);
    this.showRange();
    this.follow();
  }

  private get duration(): number {
    return this.pane.info?.timing.durationS ?? 0;
  }

  private get frameS(): number {
    return 1 / (this.pane.info?.timing.framesPerSecond || 24);
  }

  private follow(): void {
    if (!this.hasUpdated || this.held) return;
    const timeS = this.pane.picture?.player?.timeS ?? 0;
    this.slider.value = String(timeS);
    this.write(timeS);
  }

  private write(timeS: number): void {
    const frame = (timeS / this.frameS).toFixed(1);
    this.readout.textContent = `${timeS.toFixed(2)} / ${this.duration.toFixed(2)} s`;
    this.slider.setAttribute('aria-valuetext', `${timeS.toFixed(2)} seconds, frame ${frame}`);
  }

  private showRange(): void {
    const { loop, range } = this.model.state;
    const { duration } = this;
    const shown = loop === 'range' && duration > 0 && range[1] > range[0];
    this.range.hidden = !shown;
    if (!shown) return;
    this.range.style.setProperty('left', `${(100 * range[0]) / duration}%`);
    this.range.style.setProperty('width', `${(100 * (range[1] - range[0])) / duration}%`);
  }

  private onHold(): void {
    this.held = true;
    this.model.hold(this.pane);
  }

  // Pointers tell up to 1000 times a second; frames are asked for once per animation frame.
  private onInput(): void {
    const asked = this.wanted !== undefined;
    this.wanted = Number(this.slider.value);
    this.write(this.wanted);
    if (!asked) requestAnimationFrame(() => this.ask());
  }

  private ask(): void {
    if (this.wanted === undefined) return;
    this.model.seek(this.pane, this.wanted, false);
    this.wanted = undefined;
  }

  private onChange(): void {
    this.wanted = undefined;
    this.model.seek(this.pane, Number(this.slider.value), true);
    this.letGo();
  }

  // A thumb that was not moved changes nothing: then no other event comes.
  private onPointerEnd(): void {
    setTimeout(() => this.held && this.letGo());
  }

  private letGo(): void {
    this.held = false;
    this.model.letGo(this.pane);
  }

  private onKey(event: KeyboardEvent): void {
    const timeS = this.afterKey(event.key);
    if (timeS === undefined) return;
    event.preventDefault();
    event.stopPropagation();
    this.model.seek(this.pane, clamp(timeS, 0, this.duration), true);
  }

  private afterKey(key: string): number | undefined {
    const timeS = this.pane.picture?.player?.timeS ?? 0;
    const steps: Record<string, number> = {
      ArrowLeft: -1,
      ArrowDown: -1,
      ArrowRight: 1,
      ArrowUp: 1,
      PageDown: -10,
      PageUp: 10,
    };
    if (key === 'Home') return 0;
    if (key === 'End') return this.duration;
    const step = steps[key];
    return step === undefined ? undefined : timeS + step * this.frameS;
  }
}
