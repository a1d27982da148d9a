// Styles of the page's frame.
import { css } from 'lit';

export const pageStyles = css`
  :host { display: grid; grid-template-rows: auto minmax(0, 1fr); height: 100%; }
  header {
    display: flex;
    align-items: center;
    gap: 8px;
    padding: 8px 12px;
    background: var(--panel);
    border-bottom: 1px solid var(--line);
  }
  header button { padding: 4px 8px; background: none; border-color: transparent; }
  h1 { margin: 0 12px 0 4px; font-size: 17px; font-weight: 700; letter-spacing: -0.01em; }
  h1 span { color: var(--accent); }
  nav { display: flex; gap: 4px; }
  nav a { padding: 5px 10px; border-radius: 6px; color: var(--text); text-decoration: none; }
  nav a[aria-current='page'] { background: var(--accent-soft); }
  .spacer { flex: 1; }
  .lists-button { display: none; }
  .body { display: grid; grid-template-columns: 264px 1fr; min-height: 0; position: relative; }
  aside {
    min-height: 0;
    padding: 12px;
    display: flex;
    flex-direction: column;
    background: var(--panel);
    border-right: 1px solid var(--line);
  }
  aside lb-catalog { flex: 1; }
  main { min-width: 0; min-height: 0; overflow: auto; }
  @media (max-width: 760px) {
    .lists-button { display: block; }
    .body { grid-template-columns: 1fr; }
    aside { display: none; position: absolute; inset: 0 auto 0 0; width: min(320px, 86vw); z-index: 5;
      box-shadow: 4px 0 24px rgb(0 0 0 / 0.35); }
    aside.open { display: flex; }
  }
  @media (max-width: 480px) {
    header { flex-wrap: wrap; padding-bottom: 4px; }
    nav { order: 1; width: 100%; }
  }
`;
