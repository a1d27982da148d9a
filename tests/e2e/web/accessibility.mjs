// What axe finds on a page, and what the Tab key comes to.
import { readFileSync } from 'node:fs';
import { createRequire } from 'node:module';

const axe = readFileSync(createRequire(import.meta.url).resolve('axe-core/axe.min.js'), 'utf8');

/** Of axe-core: the rule and the places of each. */
export async function violations(page) {
  await page.evaluate(axe);
  const found = await page.evaluate(() =>
    globalThis.axe.run(document, { resultTypes: ['violations'] }),
  );
  return found.violations.map(
    ({ id, nodes }) => `${id}: ${nodes.map((node) => node.target.join(' ')).join('; ')}`,
  );
}

/** The names of what the Tab key comes to, in order. */
export async function tabStops(page, most = 90) {
  const stops = [];
  for (let i = 0; i < most; ++i) {
    await page.keyboard.press('Tab');
    const stop = await page.evaluate(() => {
      let element = document.activeElement;
      while (element?.shadowRoot?.activeElement) element = element.shadowRoot.activeElement;
      if (!element || element === document.body) return '';
      const label =
        element.getAttribute('aria-label') ??
        element.labels?.[0]?.textContent ??
        element.textContent;
      return label.trim().replace(/\s+/g, ' ');
    });
    if (stop && stop === stops[0]) break;
    stops.push(stop);
  }
  return stops;
}
