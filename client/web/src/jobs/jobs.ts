// The section of jobs: operations, upload, registration, animations and families.
import { LitElement, css, html, type TemplateResult } from 'lit';
import { customElement, state } from 'lit/decorators.js';
import { token } from '../api/token.ts';
import { pageLocation, type PageLocation } from '../base/hash_location.ts';
import { controls } from '../base/styles.ts';
import './animations_view.ts';
import './families_view.ts';
import { jobBoard } from './job_board.ts';
import './operations_view.ts';
import './register_view.ts';
import './upload_view.ts';

interface View {
  id: string;
  title: string;
  render: (fields: URLSearchParams) => TemplateResult;
}

function showOperations(): void {
  pageLocation.go({ section: 'jobs', fields: new URLSearchParams({ show: 'operations' }) });
}

const views: View[] = [
  { id: 'operations', title: 'Operations', render: () => html`<lb-operations></lb-operations>` },
  {
    id: 'upload',
    title: 'Upload',
    render: () => html`<lb-upload @uploaded=${showOperations}></lb-upload>`,
  },
  {
    id: 'register',
    title: 'Register',
    render: () => html`<lb-register @registered=${showOperations}></lb-register>`,
  },
  { id: 'animations', title: 'Animations', render: () => html`<lb-animations></lb-animations>` },
  {
    id: 'families',
    title: 'Families',
    render: (fields) => {
      const id = fields.get('family') ?? '';
      return html`<lb-families current=${id && `families/${id}`}></lb-families>`;
    },
  },
];

@customElement('lb-jobs')
export class JobsSection extends LitElement {
  static override styles = [
    controls,
    css`
      :host { display: block; max-width: 1020px; margin: 0 auto; padding: 16px; }
      nav { display: flex; flex-wrap: wrap; gap: 4px; margin-bottom: 16px;
        border-bottom: 1px solid var(--line); }
      nav a { padding: 8px 12px; color: var(--text); text-decoration: none;
        border-bottom: 2px solid transparent;
        margin-bottom: -1px; }
      nav a[aria-current='page'] { border-color: var(--accent); font-weight: 600; }
      nav a:hover { color: var(--accent); }
    `,
  ];

  @state() private place: PageLocation = pageLocation.value;
  private unsubscribes: (() => void)[] = [];

  override connectedCallback(): void {
    super.connectedCallback();
    this.unsubscribes = [
      pageLocation.subscribe((place) => (this.place = place)),
      jobBoard.follow(),
      token.subscribe(() => void jobBoard.refresh()),
    ];
  }

  override disconnectedCallback(): void {
    for (const unsubscribe of this.unsubscribes) unsubscribe();
    super.disconnectedCallback();
  }

  override updated(): void {
    document.title = `${this.view.title} - liquidblend`;
  }

  private get view(): View {
    const id = this.place.fields.get('show');
    return views.find((view) => view.id === id) ?? views[0]!;
  }

  override render() {
    const { view } = this;
    return html`
      <nav aria-label="Jobs">
        ${views.map(
          ({ id, title }) =>
            html`<a href="#jobs?show=${id}"
              aria-current=${id === view.id ? 'page' : 'false'}>${title}</a>`,
        )}
      </nav>
      ${view.render(this.place.fields)}
    `;
  }
}
