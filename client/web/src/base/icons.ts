// Icons of buttons; the buttons carry the names.
import { svg, html, type SVGTemplateResult } from 'lit';

function icon(shape: SVGTemplateResult) {
  return html`<svg class="icon" viewBox="0 0 24 24" aria-hidden="true">${shape}</svg>`;
}

export const icons = {
  play: icon(svg`<path d="M7 4.5v15l13-7.5z"/>`),
  pause: icon(svg`<path d="M6 4.5h4.2v15H6zM13.8 4.5H18v15h-4.2z"/>`),
  previous: icon(svg`<path d="M6 5h2.5v14H6zM20 5v14L9.5 12z"/>`),
  next: icon(svg`<path d="M15.5 5H18v14h-2.5zM4 5v14l10.5-7z"/>`),
  menu: icon(svg`<path d="M4 6h16v2H4zM4 11h16v2H4zM4 16h16v2H4z"/>`),
  theme: icon(
    svg`<path d="M12 3a9 9 0 1 0 0 18 9 9 0 0 0 0-18zm0 2.2v13.6a6.8 6.8 0 0 1 0-13.6z"/>`,
  ),
  key: icon(
    svg`<path d="M14.5 3a6.5 6.5 0 0 0-6.2 8.5L3 16.8V21h4.2v-2.5h2.5V16h2l.8-.8A6.5 6.5 0 1 0 14.5 3zm2 3.5a1.8 1.8 0 1 1 0 3.6 1.8 1.8 0 0 1 0-3.6z"/>`,
  ),
  help: icon(
    svg`<path d="M12 3a9 9 0 1 0 0 18 9 9 0 0 0 0-18zm1.1 14.5h-2.2v-2.2h2.2zm1.9-7.3c-.6 1-1.9 1.5-1.9 2.7v.6h-2.2v-.8c0-1.9 1.6-2.5 2.2-3.3.6-.9 0-2-1.1-2-1 0-1.6.8-1.6 1.8H8.2C8.2 7 9.8 5.5 12 5.5c2.5 0 4.3 2.3 3 4.7z"/>`,
  ),
  reset: icon(
    svg`<path d="M4 4h6v2.2H6.2V10H4zM14 4h6v6h-2.2V6.2H14zM4 14h2.2v3.8H10V20H4zM17.8 14H20v6h-6v-2.2h3.8z"/>`,
  ),
  download: icon(
    svg`<path d="M10.9 4h2.2v8.2l3-3 1.6 1.6-5.7 5.7-5.7-5.7 1.6-1.6 3 3zM5 18h14v2.2H5z"/>`,
  ),
  close: icon(
    svg`<path d="m6.2 4.7 5.8 5.8 5.8-5.8 1.5 1.5-5.8 5.8 5.8 5.8-1.5 1.5-5.8-5.8-5.8 5.8-1.5-1.5 5.8-5.8-5.8-5.8z"/>`,
  ),
  refresh: icon(
    svg`<path d="M12 5a7 7 0 0 1 5 2.1V4.5h2.2V11h-6.5V8.8h2.9A4.8 4.8 0 1 0 16.8 12.5h2.2A7 7 0 1 1 12 5z"/>`,
  ),
};
