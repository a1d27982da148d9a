// One picture with its name, its errors and the camera's keys.
import { LitElement, css, html, nothing } from 'lit';
import { customElement, property, query, state } from 'lit/decorators.js';
import '../base/error_message.ts';
import { Observing } from '../base/observing.ts';
import { controls } from '../base/styles.ts';
import { OrbitInput } from '../scene/orbit_input.ts';
import type { ViewModel } from '../view/model.ts';
import type { Pane } from '../view/panes.ts';

@customElement('lb-pane')
export class PaneElement extends LitElement {
  static override styles = [
    controls,
    css`
      :host {
        display: block;
        position: relative;
        min-width: 0;
        min-height: 0;
        overflow: hidden;
      }
      canvas {
        position: absolute;
        inset: 0;
        width: 100%;
        height: 100%;
        display: block;
        touch-action: none;
        cursor: grab;
      }
      canvas:active {
        cursor: grabbing;
      }
      canvas:focus-visible {
        outline-offset: -3px;
      }
      .title {
        position: absolute;
        left: 10px;
        top: 8px;
        max-width: calc(100% - 20px);
        padding: 2px 8px;
        border-radius: 6px;
        background: color-mix(in srgb, var(--panel) 88%, transparent);
        font-size: 12px;
        overflow-wrap: anywhere;
        pointer-events: none;
      }
      lb-error {
        position: absolute;
        left: 10px;
        right: 10px;
        bottom: 10px;
      }
    `,
  ];

  @property({ attribute: false }) model!: ViewModel;
  @property({ attribute: false }) pane!: Pane;
  @property({ type: Boolean }) named = false;
  @state() private broken = '';
  @query('canvas') private canvas!: HTMLCanvasElement;
  readonly observing = new Observing(this, () => this.model.changes);

  override firstUpdated(): void {
    try {
      this.begin();
    } catch (error) {
      this.broken = `This browser cannot draw it: ${error instanceof Error ? error.message : error}`;
    }
  }

  override render() {
    const { pane } = this;
    return html`
      <canvas
        tabindex="0"
        role="application"
        aria-label=${`Picture of ${pane.title}. Arrow keys turn it, with Shift they move it, plus and minus zoom.`}
      ></canvas>
      ${this.named ? html`<div class="title">${pane.title}</div>` : nothing}
      ${this.broken ? html`<p class="title">${this.broken}</p>` : nothing}
      <lb-error .error=${pane.error}></lb-error>
    `;
  }

  private begin(): void {
    const { model, pane, canvas } = this;
    const picture = model.attach(pane, canvas);
    const resize = () => picture.setSize(canvas.clientWidth, canvas.clientHeight);
    new ResizeObserver(resize).observe(canvas);
    new OrbitInput(canvas, {
      get orbit() {
        return picture.orbit;
      },
      get radius() {
        return picture.stage.sphere.radius;
      },
      move: (orbit) => model.setOrbit(pane, orbit),
      reset: () => model.setOrbit(pane, undefined),
    });
  }
}
