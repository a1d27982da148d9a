// Styles of the editor's panes.
import { css } from 'lit';

export const editPaneStyles = css`
  :host { display: grid; grid-template-rows: minmax(0, 1fr) auto; min-width: 0; min-height: 0;
    background: var(--ground); }
  .picture { position: relative; min-height: 0; overflow: hidden; }
  canvas { position: absolute; inset: 0; width: 100%; height: 100%; display: block;
    touch-action: none; cursor: crosshair; }
  canvas:focus-visible { outline-offset: -3px; }
  svg { position: absolute; inset: 0; width: 100%; height: 100%; pointer-events: none;
    overflow: hidden; }
  .title { position: absolute; left: 10px; top: 8px; max-width: calc(100% - 20px); padding: 2px 8px;
    border-radius: 6px;
    background: color-mix(in srgb, var(--panel) 88%, transparent); font-size: 12px;
    overflow-wrap: anywhere;
    pointer-events: none; }
  .title .role { color: var(--muted); }
  .title.wanted { background: var(--accent); color: var(--on-accent); }
  .title.wanted .role { color: inherit; }
  .cross { display: none; stroke: var(--accent); stroke-width: 1.5; }
  canvas:focus-visible ~ svg .cross { display: block; }
  .mark { pointer-events: auto; cursor: grab; outline: none; touch-action: none; }
  .mark .body { stroke: #ffffff; stroke-width: 1.5; }
  .mark text { fill: #ffffff; font: 700 10px var(--font); text-anchor: middle;
    dominant-baseline: central;
    user-select: none; }
  .mark .halo { fill: none; stroke: none; }
  .mark.selected .halo { stroke: var(--text); stroke-width: 2; }
  .mark:focus-visible .halo { stroke: var(--accent); stroke-width: 3; }
  .mark.off .body { fill-opacity: 0.15; stroke-dasharray: 2 2; }
  .mark.off text { fill: var(--text); }
  .mark.check .body { stroke-dasharray: 3 2; stroke-width: 2; }
  .mark.automatic text { display: none; fill: var(--text); paint-order: stroke;
    stroke: var(--panel); stroke-width: 3px; }
  .mark.automatic:hover text, .mark.automatic.selected text, .mark.automatic:focus text {
    display: block; }
  .path { fill: none; stroke-width: 2; stroke-linejoin: round; stroke-opacity: 0.85; }
  .tie { stroke-width: 1; stroke-dasharray: 2 3; }
  lb-error { position: absolute; left: 10px; right: 10px; bottom: 10px; }
  .time { display: grid; grid-template-columns: minmax(0, 1fr) auto; gap: 2px 10px;
    align-items: center;
    padding: 6px 12px 8px; background: var(--panel); border-top: 1px solid var(--line); }
  .track { position: relative; padding-top: 12px; }
  .ticks { position: absolute; top: 0; left: 8px; right: 8px; width: calc(100% - 16px);
    height: 12px; }
  .time input { width: 100%; margin: 0; }
  output { font: 12px var(--mono); white-space: nowrap; }
`;
