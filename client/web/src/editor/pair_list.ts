// The list of a target's pairs, own ones and those that the registration found.
import { LitElement, css, html, nothing } from 'lit';
import { customElement, property } from 'lit/decorators.js';
import { repeat } from 'lit/directives/repeat.js';
import { checkedOf, numberOf, textOf } from '../base/events.ts';
import { icons } from '../base/icons.ts';
import { Observing } from '../base/observing.ts';
import { controls } from '../base/styles.ts';
import type { AutomaticPair, Residual } from '../pairs/correspondences.ts';
import { meanResidual } from '../pairs/measure.ts';
import { checkPairs, isWhole, type Kind, type Pair } from '../pairs/pairs.ts';
import { colourOf } from './colours.ts';
import type { EditorModel } from './model.ts';

const kinds: [Kind, string][] = [
  ['POINT', 'point'],
  ['TRAJECTORY', 'trajectory'],
  ['SPACE', 'space'],
];

const farEdges = 5;  // further from the surface no registration takes a place

// Which of its places is too far from the surface.
function farText({ kind }: Pair, residual: Residual, edgesM: [number, number]): string {
  const { sourceDistanceM = 0, targetDistanceM = 0 } = residual;
  const isFar = [sourceDistanceM > farEdges * edgesM[0], targetDistanceM > farEdges * edgesM[1]];
  if (isFar[0]) return 'The source is off the surface.';
  return isFar[1] && kind !== 'SPACE' ? 'The target is off the surface.' : '';
}

function residualText({ metres, frames }: Residual): string {
  return `${metres.toFixed(3)} m, ${frames.toFixed(1)} frames`;
}

@customElement('lb-pairs')
export class PairListElement extends LitElement {
  static override styles = [
    controls,
    css`
      :host { display: grid; gap: 8px; }
      h3 { margin: 6px 0 0; font-size: 13px; display: flex; justify-content: space-between;
        gap: 8px; }
      h3 .count { color: var(--muted); font-weight: 400; }
      ul { list-style: none; margin: 0; padding: 0; display: grid; gap: 4px; }
      li { display: grid; gap: 4px; padding: 6px 8px; border: 1px solid var(--line);
        border-radius: 6px;
        background: var(--raised); }
      li.selected { border-color: var(--accent); box-shadow: 0 0 0 1px var(--accent); }
      .row { display: flex; flex-wrap: wrap; gap: 4px 8px; align-items: center; }
      .row .grow { flex: 1; min-width: 0; }
      .chip { min-width: 28px; min-height: 24px; padding: 0 6px; border: 0; border-radius: 12px;
        color: #ffffff;
        font-weight: 700; font-size: 12px; }
      .chip[aria-pressed='true'] { color: #ffffff; }
      .chip.automatic { background: #55636e; }
      .off .chip, .dropped .chip { text-decoration: line-through; }
      .about { font: 12px var(--mono); color: var(--muted); overflow-wrap: anywhere; }
      .overruled { color: var(--warn); font-weight: 600; }
      .kept { color: var(--good); }
      .mini { min-height: 26px; padding: 0 7px; font-size: 12px; }
      .mini .icon { width: 14px; height: 14px; }
      select.mini { padding: 0 4px; }
      label.tick { display: inline-flex; gap: 4px; align-items: center; font-size: 12px; }
      input.length { width: 96px; min-height: 26px !important; padding: 0 6px !important;
        font: 12px var(--mono); }
      p { margin: 0; font-size: 12px; color: var(--muted); }
      .mean { padding: 8px; border-radius: 6px; background: var(--accent-soft); color: var(--text);
        font-size: 13px; }
      .mean strong { font-family: var(--mono); }
    `,
  ];

  @property({ attribute: false }) model!: EditorModel;
  readonly observing = new Observing(this, () => this.model.changes);

  override render() {
    const { pairs } = this.model.list;
    const own = pairs.filter(({ check }) => !check);
    const checks = pairs.filter(({ check }) => check);
    return html`
      ${this.renderGroup('Pairs', own, 'Click in the source, then on the same in the target.')}
      ${this.renderGroup('Check pairs', checks, 'They only measure: no registration sees them.')}
      ${this.renderMean()} ${this.renderAutomatic()}
    `;
  }

  private renderGroup(title: string, pairs: readonly Pair[], hint: string) {
    return html`
      <h3>${title}<span class="count">${pairs.length}</span></h3>
      ${
        pairs.length
          ? html`<ul aria-label=${title}>
            ${repeat(
              pairs,
              ({ number }) => number,
              (pair) => this.renderPair(pair),
            )}
          </ul>`
          : html`<p>${hint}</p>`
      }
    `;
  }

  private renderPair(pair: Pair) {
    const { model } = this;
    const { number } = pair;
    const selected = number === model.selected;
    return html`<li class="${selected ? 'selected' : ''} ${pair.enabled ? '' : 'off'}">
      <div class="row">
        <button class="chip" aria-pressed=${selected ? 'true' : 'false'}
          aria-label=${`Go to pair ${number}`}
          .style=${`background: ${colourOf(number)}`}
            @click=${() => model.goTo(number)}>${number}</button>
        <span class="about grow">${this.timesText(pair)}</span>
        <button class="mini" aria-label=${`Delete pair ${number}`} title="Delete"
          @click=${() => model.deletePair(number)}>
          ${icons.close}
        </button>
      </div>
      ${this.renderResidual(pair)} ${selected ? this.renderControls(pair) : nothing}
    </li>`;
  }

  private timesText({ source, target, kind, hard, enabled }: Pair): string {
    const time = (place: Pair['source']) => (place ? `${place.timeS.toFixed(2)} s` : '…');
    const sort = kind === 'POINT' ? '' : `, ${kind.toLowerCase()}`;
    const marks = `${sort}${hard ? ', hard' : ''}${enabled ? '' : ', off'}`;
    return `${time(source)} → ${time(target)}${marks}`;
  }

  private renderResidual(pair: Pair) {
    const residual = this.model.residuals.all.get(pair.number);
    if (!isWhole(pair)) return html`<span class="about">waits for its other place</span>`;
    if (!residual) return nothing;
    const { outcome } = residual;
    const far = farText(pair, residual, this.edgesM);
    return html`<span class="about">
      ${residualText(residual)} ${far ? html`<span class="overruled">${far}</span>` : nothing}
      ${outcome ? html`<span class=${outcome}>${outcome}</span>` : html`<span>measured</span>`}
    </span>`;
  }

  // Mean edge lengths of source and target.
  private get edgesM(): [number, number] {
    const { source, target } = this.model.infos;
    const of = (info: typeof source) => info?.animation?.meanEdgeLengthM ?? Number.POSITIVE_INFINITY;
    return [of(source), of(target)];
  }

  private renderControls(pair: Pair) {
    const { model } = this;
    const { number, kind } = pair;
    const setKind = (event: Event) =>
      model.pairs.patchPair(number, { kind: textOf(event) as Kind });
    return html`<div class="row">
      <select class="mini" aria-label=${`Kind of pair ${number}`} @change=${setKind}>
        ${kinds.map(([value, name]) => html`<option value=${value}
          .selected=${value === kind}>${name}</option>`)}
      </select>
      ${this.renderTick('hard', pair.hard, (hard) => model.pairs.patchPair(number, { hard }))}
      ${this.renderTick('check', pair.check, (check) => model.pairs.patchPair(number, { check }))}
      ${this.renderTick('on', pair.enabled, () => model.pairs.toggleEnabled(number))}
    </div>
    ${kind === 'POINT' ? nothing : this.renderLength(pair)}`;
  }

  private renderTick(name: string, on: boolean, set: (on: boolean) => void) {
    return html`<label class="tick">
      <input type="checkbox" .checked=${on}
        @change=${(event: Event) => set(checkedOf(event))} />
      ${name}
    </label>`;
  }

  private renderLength({ number, lengthS }: Pair) {
    const set = (event: Event) => {
      const value = numberOf(event);
      if (value >= 0) this.model.pairs.patchPair(number, { lengthS: value });
    };
    return html`<div class="row">
      <label class="tick">length, s
        <input class="length" type="number" min="0" step="any"
          .value=${lengthS ? String(lengthS) : ''}
          placeholder="to the end" @change=${set} />
      </label>
      <button class="mini" title="End at the source's time (e)"
        @click=${() => this.model.pairs.endAt(number, this.model.times.source)}>
        End at cursor
      </button>
    </div>`;
  }

  private renderMean() {
    const { model } = this;
    const residuals = checkPairs(model.list).flatMap(
      ({ number }) => model.residuals.all.get(number) ?? [],
    );
    const mean = meanResidual(residuals);
    if (model.residuals.error)
      return html`<p role="status">Not measured: ${model.residuals.error.message}</p>`;
    if (!mean) return nothing;
    const count = residuals.length === 1 ? '1 check pair' : `${residuals.length} check pairs`;
    return html`<p class="mean" role="status">Mean error of ${count}:
      <strong>${residualText(mean)}</strong></p>`;
  }

  private renderAutomatic() {
    const { automatic } = this.model;
    if (!automatic.length) return nothing;
    return html`
      <h3>Found by the registration<span class="count">${automatic.length}</span></h3>
      ${this.renderTick('show in the pictures', this.model.showsAutomatic, (showsAutomatic) =>
        this.model.set({ showsAutomatic }),
      )}
      <ul aria-label="Found by the registration">
        ${automatic.map((found, index) => this.renderFound(found, index))}
      </ul>
    `;
  }

  private renderFound(found: AutomaticPair, index: number) {
    const { model } = this;
    const { key, pair, confidence, residual } = found;
    const dropped = model.list.dropped.includes(key);
    const name = `A${index + 1}`;
    const selected = key === model.selectedAutomatic;
    const outcome = dropped ? 'dropped' : (residual.outcome ?? '');
    return html`<li class="${selected ? 'selected' : ''} ${dropped ? 'dropped' : ''}">
      <div class="row">
        <button class="chip automatic" aria-label=${`Go to automatic pair ${name}`}
          @click=${() => model.goToAutomatic(found)}>${name}</button>
        <span class="about grow">${this.timesText({ ...pair, number: 0 })}</span>
        <button class="mini" aria-label=${`Pin ${name}`} title="Copy into your own pairs"
          ?disabled=${dropped}
          @click=${() => model.pin(found)}>Pin</button>
        <button class="mini" aria-label=${`${dropped ? 'Keep' : 'Drop'} ${name}`}
          @click=${() => model.pairs.toggleDropped(key)}>
          ${dropped ? 'Keep' : 'Drop'}
        </button>
      </div>
      <span class="about">confidence ${confidence.toFixed(2)}, ${residualText(residual)}
        <span class=${outcome}>${outcome}</span>
      </span>
    </li>`;
  }
}
