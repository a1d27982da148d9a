// Styles of the viewer's frame.
import { css } from 'lit';

export const viewerStyles = css`
  :host {
    display: grid;
    grid-template-columns: minmax(0, 1fr) auto;
    grid-template-rows: auto minmax(0, 1fr) auto;
    grid-template-areas: 'top top' 'panes side' 'bottom side';
    height: 100%;
    min-height: 0;
  }
  .empty {
    grid-area: panes;
    place-self: center;
    color: var(--muted);
  }
  .top {
    grid-area: top;
    display: flex;
    flex-wrap: wrap;
    gap: 8px 16px;
    align-items: center;
    justify-content: space-between;
    padding: 10px 14px;
  }
  h2 {
    margin: 0;
    font-size: 16px;
    overflow-wrap: anywhere;
    min-width: 0;
  }
  .panes {
    grid-area: panes;
    display: grid;
    gap: 2px;
    min-height: 0;
    background: var(--line);
    border-block: 1px solid var(--line);
  }
  .panes.count-2 {
    grid-template-columns: 1fr 1fr;
  }
  .panes.count-3 {
    grid-template-columns: 1fr 1fr 1fr;
  }
  .panes.count-4 {
    grid-template-columns: 1fr 1fr;
    grid-template-rows: 1fr 1fr;
  }
  .cell {
    display: grid;
    grid-template-rows: minmax(0, 1fr) auto;
    min-width: 0;
    min-height: 0;
    background: var(--ground);
  }
  .cell lb-timeline {
    padding: 6px 10px;
  }
  .bottom {
    grid-area: bottom;
    display: grid;
    gap: 8px;
    padding: 10px 14px 12px;
    min-width: 0;
  }
  .side {
    grid-area: side;
    width: 264px;
    padding: 14px;
    overflow-y: auto;
    background: var(--panel);
    border-left: 1px solid var(--line);
    border-top: 1px solid var(--line);
  }
  @media (max-width: 1080px) {
    :host {
      grid-template-columns: minmax(0, 1fr);
      grid-template-rows: auto minmax(280px, 46vh) auto auto;
      grid-template-areas: 'top' 'panes' 'bottom' 'side';
      height: auto;
      min-height: 100%;
    }
    .side {
      width: auto;
      border-left: 0;
    }
  }
  @media (max-width: 560px) {
    .panes.count-2,
    .panes.count-3 {
      grid-template-columns: 1fr;
      grid-auto-rows: minmax(220px, 1fr);
    }
    :host {
      grid-template-rows: auto minmax(300px, auto) auto auto;
    }
  }
`;
