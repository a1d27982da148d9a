// Styles of the editor's frame.
import { css } from 'lit';

export const editorStyles = css`
  :host { display: grid; grid-template-columns: minmax(0, 1fr) 330px;
    grid-template-rows: auto minmax(0, 1fr);
    grid-template-areas: 'top top' 'panes side'; height: 100%; min-height: 0; }
  .top { grid-area: top; display: flex; flex-wrap: wrap; gap: 8px 12px; align-items: center;
    padding: 10px 14px;
    border-bottom: 1px solid var(--line); }
  h2 { margin: 0; font-size: 16px; overflow-wrap: anywhere; min-width: 0; }
  .spacer { flex: 1; }
  .group { display: flex; flex-wrap: wrap; gap: 6px; align-items: center; }
  .group label { display: inline-flex; gap: 6px; align-items: center; }
  .icon-button { padding: 4px 8px; }
  .panes { grid-area: panes; display: grid; grid-template-columns: 1fr 1fr; gap: 2px; min-height: 0;
    background: var(--line); }
  .side { grid-area: side; min-width: 0; padding: 14px; overflow-y: auto; display: grid; gap: 16px;
    align-content: start;
    background: var(--panel); border-left: 1px solid var(--line); }
  .side > * + * { padding-top: 14px; border-top: 1px solid var(--line); }
  .empty { grid-area: panes; place-self: center; padding: 20px; text-align: center;
    color: var(--muted); background: none; }
  @media (max-width: 1080px) {
    :host { grid-template-columns: minmax(0, 1fr); grid-template-rows: auto minmax(320px,
      52vh) auto;
      grid-template-areas: 'top' 'panes' 'side'; height: auto; min-height: 100%; }
    .side { border-left: 0; border-top: 1px solid var(--line); }
  }
  @media (max-width: 560px) {
    :host { grid-template-rows: auto auto auto; }
    .panes { grid-template-columns: 1fr; grid-auto-rows: 300px; }
  }
`;
