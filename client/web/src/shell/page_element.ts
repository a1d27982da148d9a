// The page: header, lists and the section that is open.
import { LitElement, html, nothing } from 'lit';
import { customElement, query, state } from 'lit/decorators.js';
import { catalog } from '../api/catalog.ts';
import { staleError, type ApiError } from '../api/errors.ts';
import { token } from '../api/token.ts';
import '../base/error_message.ts';
import { pageLocation, type PageLocation } from '../base/hash_location.ts';
import { icons } from '../base/icons.ts';
import { roundTo } from '../base/numbers.ts';
import { controls } from '../base/styles.ts';
import { setTheme, theme } from '../base/theme.ts';
import './catalog_list.ts';
import { pageStyles } from './page_styles.ts';
import { sectionOf, sections, type Section } from './sections.ts';
import './token_dialog.ts';
import type { TokenDialog } from './token_dialog.ts';

@customElement('lb-page')
export class PageElement extends LitElement {
  static override styles = [controls, pageStyles];

  @state() private location: PageLocation = pageLocation.value;
  @state() private loaded = '';
  @state() private listsOpen = false;
  @state() private error: ApiError | undefined;
  @query('lb-token-dialog') private tokenDialog!: TokenDialog;
  private asked = false;  // for the token, since it was typed

  override connectedCallback(): void {
    super.connectedCallback();
    pageLocation.subscribe((location) => (this.location = location));
    theme.subscribe(() => this.requestUpdate());
    token.subscribe(() => {
      this.asked = false;
      void catalog.refresh();
    });
    catalog.subscribe((lists) => this.onLists(!lists.loading && !!lists.error?.needsToken));
    void catalog.refresh();
    this.addEventListener('keydown', (event) => this.onKey(event));
  }

  private get section(): Section {
    return sectionOf(this.location.section);
  }

  private get current(): string {
    const { fields } = this.location;
    const family = fields.get('family');
    if (family) return `families/${family}`;
    const animation = fields.get('animation');
    return animation ? `animations/${animation}` : '';
  }

  override updated(): void {
    const { section } = this;
    if (this.loaded === section.id) return;
    void this.load(section);
  }

  private async load(section: Section): Promise<void> {
    try {
      await section.load();
      this.loaded = section.id;
      this.error = undefined;
    } catch {
      this.error = staleError();
    }
  }

  override render() {
    return html`
      ${this.renderHeader()}
      <div class="body">
        <aside id="lists" class=${this.listsOpen ? 'open' : ''} aria-label="Families and animations">
          <lb-catalog .current=${this.current} @choose=${this.onChoose}></lb-catalog>
        </aside>
        <main>
          ${this.error ? html`<lb-error .error=${this.error}></lb-error>` : nothing}
          ${this.loaded === this.section.id ? this.section.render() : nothing}
        </main>
      </div>
      <lb-token-dialog></lb-token-dialog>
    `;
  }

  private renderHeader() {
    return html`
      <header>
        <button
          class="lists-button"
          aria-label="Lists"
          aria-expanded=${this.listsOpen ? 'true' : 'false'}
          aria-controls="lists"
          @click=${() => (this.listsOpen = !this.listsOpen)}
        >
          ${icons.menu}
        </button>
        <h1>liquid<span>blend</span></h1>
        ${sections.length > 1 ? html`<nav aria-label="Sections">${sections.map((s) => this.renderLink(s))}</nav>` : nothing}
        <div class="spacer"></div>
        <button aria-label="Token" title="Token" @click=${() => this.tokenDialog.open()}>${icons.key}</button>
        <button
          aria-label=${theme.value === 'dark' ? 'Use the light theme' : 'Use the dark theme'}
          title="Theme"
          @click=${() => setTheme(theme.value === 'dark' ? 'light' : 'dark')}
        >
          ${icons.theme}
        </button>
      </header>
    `;
  }

  private renderLink(section: Section) {
    const open = section === this.section;
    return html`<a href="#${section.id}" aria-current=${open ? 'page' : 'false'}>${section.title}</a>`;
  }

  private onLists(needsToken: boolean): void {
    if (needsToken && !this.asked) {
      this.asked = true;
      void this.updateComplete.then(() => this.tokenDialog.open());
    }
    if (!needsToken && !this.current && this.section.id === 'view') this.openNewest();
  }

  // The family that was registered last.
  private openNewest(): void {
    const seconds = (family: { updateTime?: { seconds: bigint } | undefined }) =>
      Number(family.updateTime?.seconds ?? 0n);
    const families = catalog.value.families.filter((family) => family.version);
    const newest = families.reduce<(typeof families)[0] | undefined>(
      (best, family) => (!best || seconds(family) > seconds(best) ? family : best),
      undefined,
    );
    if (newest) this.open(newest.name, true, newest.parameterSpace ? 0 : newest.targets.length);
  }

  private onChoose(event: CustomEvent<string>): void {
    this.listsOpen = false;
    this.open(event.detail, false);
  }

  // `numTargets`: each weighs as much as the source, so that something new is seen at once.
  private open(name: string, byItself: boolean, numTargets = 0): void {
    const [collection, id] = name.split('/') as [string, string];
    if (collection === 'families' && !byItself && this.section.id !== 'view') {
      return this.openInSection(id);
    }
    const fields = new URLSearchParams({ [collection === 'families' ? 'family' : 'animation']: id, play: '1' });
    const weight = roundTo(1 / (numTargets + 1), 6);
    if (numTargets) fields.set('w', Array(numTargets).fill(weight).join(','));
    const place = { section: 'view', fields };
    if (byItself) pageLocation.show(place);
    else pageLocation.go(place);
  }

  // The editor, and the verdicts of Jobs, have families of their own.
  private openInSection(id: string): void {
    const { id: section } = this.section;
    const show: Record<string, string> = section === 'jobs' ? { show: 'families' } : {};
    pageLocation.go({ section, fields: new URLSearchParams({ ...show, family: id }) });
  }

  private onKey(event: KeyboardEvent): void {
    if (event.key === 'Escape' && this.listsOpen) this.listsOpen = false;
  }
}
