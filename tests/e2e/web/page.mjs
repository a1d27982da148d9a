// A browser, and pages of the server in it that are watched.
import assert from 'node:assert/strict';
import { after } from 'node:test';
import { chromium } from 'playwright-core';

export const baseUrl = process.env.BASE_URL.replace(/\/$/, '');
export const token = process.env.TOKEN ?? '';
export const family = process.env.FAMILY ?? 'two_drops';

/** How many times as long as on an idle machine a test waits, as the other end-to-end tests do. */
export const slowness = Math.max(180, Number(process.env.LIQUIDBLEND_E2E_PATIENCE ?? 0)) / 60;

let browser;

/** Drawn by the processor, as everywhere where tests run. */
async function launch() {
  browser ??= await chromium.launch({
    executablePath: process.env.CHROMIUM ?? '/usr/bin/chromium',
    args: ['--no-sandbox', '--enable-unsafe-swiftshader', '--disable-gpu-compositing'],
  });
  return browser;
}

after(async () => {
  await browser?.close();
  browser = undefined;
});

/** What a page did that it should not: requests elsewhere, violations, errors. */
function watch(page) {
  const seen = { requests: [], foreign: [], violations: [], errors: [] };
  page.on('request', (request) => {
    seen.requests.push(request);
    if (!request.url().startsWith(`${baseUrl}/`)) seen.foreign.push(request.url());
  });
  page.on('pageerror', (error) => seen.errors.push(error.message));
  page.on('console', (message) => {
    if (message.type() === 'error') seen.errors.push(message.text());
    if (/content security policy/i.test(message.text())) seen.violations.push(message.text());
  });
  return seen;
}

/** A page that was never here before. Close it by `context().close()`. */
export async function newPage({ width = 1280, height = 800, theme = 'light', ...options } = {}) {
  const context = await (
    await launch()
  ).newContext({
    viewport: { width, height },
    colorScheme: theme,
    ...options,
  });
  await context.addInitScript(
    (value) => {
      globalThis.violations = [];
      document.addEventListener('securitypolicyviolation', (event) => {
        globalThis.violations.push(`${event.violatedDirective} ${event.blockedURI}`);
      });
      if (value && location.protocol !== 'about:') sessionStorage.setItem('liquidblend.token', value);
    },
    options.withoutToken ? '' : token,
  );
  const page = await context.newPage();
  page.setDefaultTimeout(30_000 * slowness);
  page.seen = watch(page);
  return page;
}

/** Opens the viewer with fields of its URL, and waits for the first frame. */
export async function openViewer(page, fields = {}) {
  const query = new URLSearchParams({ family, ...fields });
  await page.goto('about:blank');
  await page.goto(`${baseUrl}/#view?${query}`);
  await waitFor(page, (pane) => pane.shown > 0);
}

/** The counters of the picture in front, and those of the page. */
export function counters(page) {
  return page.evaluate(() => {
    const { panes, decoded, buffersMade } = globalThis.liquidblend;
    return { ...panes[0], decoded, buffersMade, nowMs: performance.now() };
  });
}

/** Waits until a condition returns something, and returns that. `tell`: what never happened. */
export async function until(condition, tell = () => `${condition}`) {
  const end = Date.now() + 20_000 * slowness;
  for (;;) {
    const found = await condition();
    if (found) return found;
    if (Date.now() > end) throw new Error(`never: ${tell()}`);
    await new Promise((resolve) => setTimeout(resolve, 30));
  }
}

/** The counters of all pictures. */
export function panes(page) {
  return page.evaluate(() => globalThis.liquidblend?.panes ?? []);
}

/** Waits until a condition on the counters of all pictures holds. `text`: of it, for errors. */
export async function waitForPanes(page, condition, text = condition) {
  let list;
  await until(
    async () => condition((list = await panes(page))),
    () => `${text}, but ${JSON.stringify(list)}`,
  );
  return list;
}

/** Waits until a condition on the counters of the picture in front holds. */
export async function waitFor(page, condition) {
  const [pane] = await waitForPanes(page, ([first]) => first && condition(first), condition);
  return pane;
}

/** Waits until what input changed is on the page: it may be put off to the next animation frame. */
export function drawn(page) {
  return page.evaluate(
    () => new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done))),
  );
}

/** Waits until nothing moves and the picture is as fine as it gets. */
export function settled(page) {
  return waitFor(page, (pane) => pane.settled && !pane.running && !pane.waiting);
}

export async function sizeCanvas(page, width, height) {
  for (let i = 0; i < 3; ++i) {
    const box = await page.locator('canvas').first().boundingBox();
    const now = page.viewportSize();
    await page.setViewportSize({
      width: Math.round(now.width + width - box.width),
      height: Math.round(now.height + height - box.height),
    });
  }
}

export function report(name, figures) {
  console.log(`# ${name}: ${JSON.stringify(figures)}`);
}

const strict = process.env.STRICT_TIMES === '1';

/** Of a figure of time, which counts only on a machine that does nothing else (STRICT_TIMES=1). */
export function assertTime(holds, message) {
  if (strict) assert.ok(holds, message);
  else if (!holds) console.log(`# not counted: ${message}`);
}
