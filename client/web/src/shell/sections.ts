// The sections of the page. A new one gets a line here; its code is fetched when it is opened.
import { html, type TemplateResult } from 'lit';

export interface Section {
  id: string;
  title: string;
  load: () => Promise<unknown>;
  render: () => TemplateResult;
}

export const sections: Section[] = [
  {
    id: 'view',
    title: 'Viewer',
    load: () => import('../viewer/viewer.ts'),
    render: () => html`<lb-viewer></lb-viewer>`,
  },
  {
    id: 'edit',
    title: 'Editor',
    load: () => import('../editor/editor.ts'),
    render: () => html`<lb-editor></lb-editor>`,
  },
  {
    id: 'jobs',
    title: 'Jobs',
    load: () => import('../jobs/jobs.ts'),
    render: () => html`<lb-jobs></lb-jobs>`,
  },
];

export function sectionOf(id: string): Section {
  return sections.find((section) => section.id === id) ?? sections[0]!;
}
