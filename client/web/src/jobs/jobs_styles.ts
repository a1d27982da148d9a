// Styles that the views of this section share.
import { css } from 'lit';

export const jobsStyles = css`
  :host { display: block; }
  lb-error { display: contents; }
  h2 { margin: 0; font-size: 14px; overflow-wrap: anywhere; }
  p { margin: 0; overflow-wrap: anywhere; }
  .view { display: grid; gap: 16px; min-width: 0; }
  .card { display: grid; gap: 12px; min-width: 0; padding: 16px; background: var(--panel);
    border: 1px solid var(--line);
    border-radius: var(--radius); }
  .head { display: flex; flex-wrap: wrap; gap: 6px 12px; align-items: center;
    justify-content: space-between; }
  .head .title { font-weight: 600; overflow-wrap: anywhere; min-width: 0; }
  .actions { display: flex; flex-wrap: wrap; gap: 8px; align-items: center; }
  a.button { display: inline-flex; align-items: center; min-height: 32px; padding: 4px 10px;
    border: 1px solid var(--line);
    border-radius: 6px; background: var(--raised); color: var(--text); text-decoration: none; }
  a.button:hover { border-color: var(--accent); }
  button.danger { color: var(--bad); }
  .fields { display: grid; grid-template-columns: repeat(auto-fill, minmax(min(220px, 100%), 1fr));
    gap: 12px 16px;
    align-items: start; }
  label.field { display: grid; gap: 4px; min-width: 0; font-weight: 600; font-size: 13px; }
  label.field > input, label.field > select { width: 100%; font-weight: 400; }
  label.field .hint, .hint { font-weight: 400; font-size: 12px; color: var(--muted); }
  label.check { display: flex; gap: 8px; align-items: center; min-height: 32px; }
  dl.figures { display: flex; flex-wrap: wrap; gap: 4px 20px; margin: 0; font-size: 12px; }
  dl.figures div { display: flex; gap: 5px; }
  dl.figures dt { color: var(--muted); }
  dl.figures dd { margin: 0; font-family: var(--mono); overflow-wrap: anywhere; }
  .mark { font-size: 12px; padding: 1px 8px; border-radius: 10px; border: 1px solid currentColor;
    white-space: nowrap; }
  .mark.good, .mark.done { color: var(--good); }
  .mark.doubtful { color: var(--warn); }
  .mark.bad, .mark.failed { color: var(--bad); }
  .mark.none, .mark.cancelled { color: var(--muted); }
  .mark.running { color: var(--accent); }
  ul.plain { list-style: none; margin: 0; padding: 0; display: grid; gap: 10px; }
  progress { appearance: none; width: 100%; height: 8px; border: 0; border-radius: 4px;
    overflow: hidden;
    background: var(--accent-soft); }
  progress::-webkit-progress-bar { background: var(--accent-soft); }
  progress::-webkit-progress-value { background: var(--accent); border-radius: 4px;
    transition: width 0.3s; }
  progress::-moz-progress-bar { background: var(--accent); }
  .empty { padding: 24px; text-align: center; color: var(--muted); }
  .scroll { overflow-x: auto; }
  table { border-collapse: collapse; width: 100%; font-size: 13px; }
  th, td { padding: 6px 10px 6px 0; text-align: left; vertical-align: top;
    border-bottom: 1px solid var(--line); }
  th { font-weight: 600; color: var(--muted); font-size: 12px; }
  td.number { font-family: var(--mono); white-space: nowrap; }
  details > summary { cursor: pointer; font-weight: 600; }
`;
