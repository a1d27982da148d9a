// What is shown and how: shading, level of detail, what stands beside the blend.
import { LitElement, css, html, nothing, type TemplateResult } from 'lit';
import { customElement, property } from 'lit/decorators.js';
import { icons } from '../base/icons.ts';
import '../base/menu.ts';
import { Observing } from '../base/observing.ts';
import { controls } from '../base/styles.ts';
import type { Shading } from '../scene/stage.ts';
import type { ViewModel } from '../view/model.ts';
import { maxBeside, type Beside } from '../view/state.ts';

@customElement('lb-toolbar')
export class Toolbar extends LitElement {
  static override styles = [
    controls,
    css`
      :host {
        display: flex;
        flex-wrap: wrap;
        gap: 8px;
        align-items: center;
      }
      .group {
        display: flex;
      }
      .group button {
        border-radius: 0;
        margin-left: -1px;
      }
      .group button:first-child {
        border-radius: 6px 0 0 6px;
        margin-left: 0;
      }
      .group button:last-child {
        border-radius: 0 6px 6px 0;
      }
      label {
        display: flex;
        gap: 6px;
        align-items: center;
      }
      fieldset {
        border: 0;
        margin: 0;
        padding: 0;
        display: grid;
        gap: 8px;
        min-width: 0;
      }
      legend {
        padding: 0 0 6px;
        font-weight: 600;
      }
      .icon-button {
        padding: 4px 8px;
      }
      label span {
        overflow-wrap: anywhere;
      }
    `,
  ];

  @property({ attribute: false }) model!: ViewModel;
  readonly observing = new Observing(this, () => this.model.changes);

  override render() {
    return html`
      <div class="group" role="group" aria-label="Shading">
        ${this.renderShading('liquid', 'Liquid')} ${this.renderShading('plain', 'Plain')}
      </div>
      ${this.renderToggle('wireframe', 'Wireframe', 'Wireframe (w)')}
      ${this.model.main?.info?.family
        ? this.renderToggle('pattern', 'Pattern', 'A grid that stays on the liquid (p)')
        : nothing}
      ${this.renderLevels()} ${this.renderBeside()}
      <button
        class="icon-button"
        aria-label="Fit into view"
        title="Fit into view (f)"
        @click=${() => this.model.fit()}
      >
        ${icons.reset}
      </button>
      ${this.renderOpener('download', 'Download', 'd', icons.download)}
      ${this.renderOpener('help', 'Keys', '?', icons.help)}
    `;
  }

  private renderOpener(event: string, name: string, key: string, icon: TemplateResult) {
    return html`<button
      class="icon-button"
      aria-label=${name}
      title=${`${name} (${key})`}
      @click=${() => this.dispatchEvent(new CustomEvent(event))}
    >
      ${icon}
    </button>`;
  }

  private renderShading(shading: Shading, name: string) {
    return html`<button
      aria-pressed=${this.model.state.shading === shading ? 'true' : 'false'}
      title=${`${name} shading (s)`}
      @click=${() => this.model.patch({ shading })}
    >
      ${name}
    </button>`;
  }

  private renderToggle(field: 'wireframe' | 'pattern', name: string, title: string) {
    const isOn = this.model.state[field];
    return html`<button
      aria-pressed=${isOn ? 'true' : 'false'}
      title=${title}
      @click=${() => this.model.patch({ [field]: !isOn })}
    >
      ${name}
    </button>`;
  }

  private renderLevels() {
    const numLevels = this.model.main?.info?.timing.numLevels ?? 1;
    const { level } = this.model.state;
    const names = ['finest', 'half', 'quarter', 'eighth'];
    const select = (event: Event) => {
      const { value } = event.target as HTMLSelectElement;
      this.model.patch({ level: value === 'auto' ? 'auto' : Number(value) });
    };
    return html`<select aria-label="Level of detail" title="Level of detail" @change=${select}>
      <option value="auto" .selected=${level === 'auto'}>Detail: auto</option>
      ${Array.from(
        { length: numLevels },
        (_, at) =>
          html`<option value=${at} .selected=${level === at}>
            Detail: ${at}${names[at] ? ` (${names[at]})` : ''}
          </option>`,
      )}
    </select>`;
  }

  private renderBeside() {
    const family = this.model.main?.info?.family;
    if (!family) return nothing;
    const { state } = this.model;
    const kept = family.keptVersions.map(({ version }) => `version.${version}` as Beside);
    const targets = family.targets.map((_, index) => `target.${index + 1}` as Beside);
    return html`
      <lb-menu label="Side by side">
        <fieldset>
          <legend>Beside the blend</legend>
          ${this.renderChoice('source', `Source: ${shortName(family.source)}`)}
          ${targets.map((key, at) => this.renderChoice(key, `Target: ${shortName(family.targets[at]!)}`))}
          ${kept.map((key) => this.renderChoice(key, `Version ${key.slice('version.'.length)}`))}
        </fieldset>
        <fieldset>
          <legend>Together</legend>
          <label>
            <input
              type="checkbox"
              .checked=${state.oneCamera}
              @change=${() => this.model.setTogether('oneCamera')}
            />
            Cameras
          </label>
          <label>
            <input
              type="checkbox"
              .checked=${state.oneTime}
              @change=${() => this.model.setTogether('oneTime')}
            />
            Times
          </label>
        </fieldset>
      </lb-menu>
    `;
  }

  private renderChoice(key: Beside, name: string) {
    const { beside } = this.model.state;
    const chosen = beside.includes(key);
    const change = () =>
      this.model.setBeside(chosen ? beside.filter((item) => item !== key) : [...beside, key]);
    return html`<label>
      <input
        type="checkbox"
        .checked=${chosen}
        ?disabled=${!chosen && beside.length >= maxBeside}
        @change=${change}
      />
      <span>${name}</span>
    </label>`;
  }
}

function shortName(name: string): string {
  return name.slice(name.indexOf('/') + 1);
}
