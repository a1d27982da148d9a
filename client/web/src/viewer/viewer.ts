// The viewer: pictures side by side, the timeline, weights, figures and their keys.
import { LitElement, html, nothing } from 'lit';
import { customElement, query, state } from 'lit/decorators.js';
import { repeat } from 'lit/directives/repeat.js';
import { staleError, type ApiError } from '../api/errors.ts';
import { token } from '../api/token.ts';
import '../base/error_message.ts';
import { pageLocation, type PageLocation } from '../base/hash_location.ts';
import { controls } from '../base/styles.ts';
import { showTheme, theme } from '../base/theme.ts';
import type { Family } from '../generated/liquidblend/v1/liquidblend_pb.ts';
import { actionOf } from '../view/keys.ts';
import { ViewModel } from '../view/model.ts';
import type { Pane } from '../view/panes.ts';
import { fromFields, toFields } from '../view/state.ts';
import './download_dialog.ts';
import type { DownloadDialog } from './download_dialog.ts';
import './figures.ts';
import './help_dialog.ts';
import type { HelpDialog } from './help_dialog.ts';
import './pace.ts';
import './pane.ts';
import { publish } from './published.ts';
import './timeline.ts';
import './toolbar.ts';
import { viewerStyles } from './viewer_styles.ts';
import './weights.ts';

@customElement('lb-viewer')
export class Viewer extends LitElement {
  static override styles = [controls, viewerStyles];

  private readonly model = new ViewModel();
  @state() private hasPad = false;
  @state() private loadError: ApiError | undefined;
  private asksForPad = false;
  @query('lb-download') private download!: DownloadDialog;
  @query('lb-help') private help!: HelpDialog;
  private unsubscribes: (() => void)[] = [];

  override connectedCallback(): void {
    super.connectedCallback();
    publish(this.model);
    this.unsubscribes = [
      pageLocation.subscribe((location) => this.read(location)),
      this.model.changes.subscribe(() => this.requestUpdate()),
      this.model.states.subscribe(() => this.write()),
      theme.subscribe((value) => this.model.patch({ theme: value })),
      token.subscribe(() => void this.model.open(this.model.state)),
    ];
    this.read(pageLocation.value);
    document.addEventListener('visibilitychange', this.onVisibility);
    document.addEventListener('keydown', this.onKey);
  }

  override disconnectedCallback(): void {
    for (const unsubscribe of this.unsubscribes) unsubscribe();
    document.removeEventListener('visibilitychange', this.onVisibility);
    document.removeEventListener('keydown', this.onKey);
    this.model.close();
    super.disconnectedCallback();
  }

  override render() {
    const { panes, main } = this.model;
    if (!main) return html`<p class="empty">Choose a family or an animation from the lists.</p>`;
    return html`
      <div class="top">
        <h2>${main.title}</h2>
        <lb-toolbar .model=${this.model} @download=${() => this.download.open()} @help=${() => this.help.open()}></lb-toolbar>
      </div>
      <div class="panes count-${panes.length}">
        ${repeat(panes, (pane) => pane.key, (pane) => this.renderPane(pane))}
      </div>
      <div class="bottom">
        <lb-timeline .model=${this.model} .pane=${main}></lb-timeline>
        <lb-pace .model=${this.model}></lb-pace>
        <lb-figures .pane=${main}></lb-figures>
      </div>
      ${main.info?.family ? this.renderSide(main.info.family) : nothing}
      <lb-download .model=${this.model}></lb-download>
      <lb-help></lb-help>
    `;
  }

  override updated(): void {
    const title = this.model.main?.title;
    document.title = title ? `${title} - liquidblend` : 'liquidblend';
  }

  private renderSide({ parameterSpace }: Family) {
    if (parameterSpace && !this.asksForPad) void this.loadPad();
    return html`<div class="side">
      ${parameterSpace && this.hasPad ? html`<lb-pad .model=${this.model}></lb-pad>` : nothing}
      ${this.loadError ? html`<lb-error .error=${this.loadError}></lb-error>` : nothing}
      <lb-weights .model=${this.model}></lb-weights>
    </div>`;
  }

  private async loadPad(): Promise<void> {
    this.asksForPad = true;
    try {
      await import('../pad/pad.ts');
      this.hasPad = true;
    } catch {
      this.loadError = staleError();
    }
  }

  private renderPane(pane: Pane) {
    const { model } = this;
    const own = pane !== model.main && !model.state.oneTime;
    return html`<div class="cell">
      <lb-pane .model=${model} .pane=${pane} ?named=${model.panes.length > 1}></lb-pane>
      ${own ? html`<lb-timeline .model=${model} .pane=${pane}></lb-timeline>` : nothing}
    </div>`;
  }

  private read({ section, fields }: PageLocation): void {
    if (section && section !== 'view') return;
    const state = fromFields(fields);
    if (state.theme) showTheme(state.theme);
    void this.model.open(state);
  }

  private write(): void {
    const { state } = this.model;
    if (state.name) pageLocation.replace({ section: 'view', fields: toFields(state) });
  }

  // Nobody sees a hidden page: its frames are not sent.
  private readonly onVisibility = () => {
    for (const { picture } of this.model.panes) {
      if (document.hidden) picture?.player?.hold();
      else picture?.player?.letGo();
    }
  };

  private readonly onKey = (event: KeyboardEvent) => {
    const action = actionOf(event);
    if (!action || !this.model.main) return;
    event.preventDefault();
    if (action === 'download') this.download.open();
    else if (action === 'help') this.help.open();
    else this.model.act(action);
  };
}
