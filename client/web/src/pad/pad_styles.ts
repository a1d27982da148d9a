// Styles of the pad.
import { css } from 'lit';

export const padStyles = css`
  :host { display: grid; gap: 8px; margin-bottom: 18px; }
  h3 { margin: 0; font-size: 13px; font-weight: 600; }
  svg { width: 100%; max-width: 420px; justify-self: center; display: block; touch-action: none;
    cursor: crosshair;
    border: 1px solid var(--control); border-radius: 6px; background: var(--warn-soft); }
  .area { fill: var(--panel); stroke: none; }
  .inner { stroke: var(--control); stroke-width: 1; stroke-dasharray: 3 3; }
  .hull { stroke: var(--accent); stroke-width: 1.5; }
  .point { fill: var(--text); }
  .label { fill: var(--text); font: 11px var(--font); paint-order: stroke; stroke: var(--panel);
    stroke-width: 3px;
    stroke-opacity: 0.75; pointer-events: none; user-select: none; }
  .name { fill: var(--muted); font: 11px var(--mono); pointer-events: none; user-select: none; }
  .marker { outline: none; cursor: grab; }
  .ring { fill: var(--accent); fill-opacity: 0.18; stroke: var(--accent); stroke-width: 1; }
  .marker:focus-visible .ring { stroke-width: 3; }
  .dot { fill: var(--accent); stroke: var(--panel); stroke-width: 1.5; }
  .hollow { fill: var(--panel); stroke: var(--warn); stroke-width: 1.5; }
  .outside .ring { fill: var(--warn); stroke: var(--warn); }
  .outside .dot { fill: var(--warn); }
  .way { stroke: var(--warn); stroke-width: 1.5; stroke-dasharray: 4 3; }
  .used { fill: var(--accent); stroke: var(--panel); stroke-width: 1.5; }
  .axes { display: flex; gap: 8px; font-size: 12px; }
  .axes label { display: grid; gap: 2px; flex: 1; min-width: 0; }
  .value { display: grid; grid-template-columns: 1fr 110px; gap: 2px 8px; align-items: center;
    font-size: 13px; }
  .value label { overflow-wrap: anywhere; }
  .value input[type='number'] { width: 100%; font: 13px var(--mono); text-align: right; }
  .value input[type='range'] { grid-column: 1 / -1; width: 100%; }
  .check { display: flex; gap: 8px; align-items: center; font-size: 13px; min-height: 28px; }
  .note { margin: 0; font-size: 12px; color: var(--warn); }
  .note:empty { display: none; }
  .weights { margin: 0; display: grid; gap: 2px; font-size: 12px; }
  .weights div { display: flex; justify-content: space-between; gap: 8px; }
  .weights dt { overflow-wrap: anywhere; }
  .weights dd { margin: 0; font-family: var(--mono); }
  .weights .none { color: var(--muted); }
`;
