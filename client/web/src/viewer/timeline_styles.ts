// Styles of the timeline.
import { css } from 'lit';

export const timelineStyles = css`
  :host {
    display: grid;
    grid-template-columns: auto 1fr auto;
    gap: 10px;
    align-items: center;
  }
  .play {
    width: 40px;
    height: 40px;
    padding: 0;
    display: grid;
    place-items: center;
    border-radius: 50%;
    background: var(--accent);
    border-color: var(--accent);
    color: var(--on-accent);
  }
  .slider {
    position: relative;
    display: grid;
    align-items: center;
  }
  .range {
    position: absolute;
    height: 14px;
    border-radius: 4px;
    background: var(--accent-soft);
    border: 1px solid var(--accent);
    pointer-events: none;
  }
  input {
    width: 100%;
    margin: 0;
    height: 32px;
    position: relative;
    background: none;
  }
  .readout {
    font: 12px var(--mono);
    color: var(--muted);
    min-width: 13ch;
    text-align: right;
  }
`;
