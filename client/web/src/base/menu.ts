// A button that opens a panel below it. Escape and clicks elsewhere close it.
import { LitElement, css, html } from 'lit';
import { customElement, property, query, state } from 'lit/decorators.js';
import { controls } from './styles.ts';

@customElement('lb-menu')
export class Menu extends LitElement {
  static override styles = [
    controls,
    css`
      :host {
        position: relative;
        display: inline-block;
      }
      .panel {
        position: absolute;
        right: 0;
        top: calc(100% + 6px);
        z-index: 4;
        width: max-content;
        max-width: min(320px, calc(100vw - 24px));
        padding: 14px;
        display: grid;
        gap: 10px;
        background: var(--panel);
        border: 1px solid var(--line);
        border-radius: var(--radius);
        box-shadow: 0 8px 28px rgb(0 0 0 / 0.28);
      }
    `,
  ];

  @property() label = '';
  @state() private open = false;
  @query('button') private button!: HTMLButtonElement;
  private readonly onOutside = (event: Event) => {
    if (!event.composedPath().includes(this)) this.open = false;
  };

  override connectedCallback(): void {
    super.connectedCallback();
    document.addEventListener('pointerdown', this.onOutside);
  }

  override disconnectedCallback(): void {
    document.removeEventListener('pointerdown', this.onOutside);
    super.disconnectedCallback();
  }

  override render() {
    return html`
      <button
        aria-expanded=${this.open ? 'true' : 'false'}
        aria-controls="panel"
        @click=${() => (this.open = !this.open)}
        @keydown=${this.onKey}
      >
        ${this.label}
      </button>
      <div id="panel" class="panel" ?hidden=${!this.open} @keydown=${this.onKey}><slot></slot></div>
    `;
  }

  private onKey(event: KeyboardEvent): void {
    if (event.key !== 'Escape' || !this.open) return;
    event.stopPropagation();
    this.open = false;
    this.button.focus();
  }
}
