// The editor in a page: its panes, markers and pairs.
import assert from 'node:assert/strict';
import { readFileSync } from 'node:fs';
import { after, before } from 'node:test';
import { api, ensureClips, ensureFamily } from './library.mjs';
import { baseUrl, newPage } from './page.mjs';

/** A family of the test's own, deleted after it. */
export const family = `e2e_edit_${Date.now().toString(36)}_${process.pid}`;

before(async () => {
  const [source, target] = await ensureClips();
  await ensureFamily(family, {
    source,
    targets: [target],
    options: { maxIterations: 2 },
    spaceTime: { coarserLevels: 0 },
  });
});

after(() => api(`/v1/families/${family}`, { method: 'DELETE' }));

/** Does something in the editor, once both animations are shown. */
export async function withEditor(act, { fields = {}, ...options } = {}) {
  const page = await newPage(options);
  try {
    await page.goto(`${baseUrl}/#edit?${new URLSearchParams({ family, ...fields })}`);
    await shown(page);
    await act(page);
    assert.deepEqual(page.seen.errors, []);
    assert.deepEqual(await page.evaluate(() => globalThis.violations), []);
  } finally {
    await page.context().close();
  }
}

/** Waits until both pictures show the frames of their cursors. */
export async function shown(page) {
  await page.waitForFunction(() => {
    const editor = document
      .querySelector('lb-page')
      ?.shadowRoot.querySelector('lb-editor')?.shadowRoot;
    const panes = [...(editor?.querySelectorAll('lb-edit-pane') ?? [])];
    return panes.length === 2 && panes.every((pane) => pane.ready);
  });
}

export function canvas(page, side) {
  return page.locator('lb-edit-pane canvas').nth(side === 'source' ? 0 : 1);
}

/** A click at a part of a picture's width and height. */
export async function click(page, side, x, y) {
  const box = await canvas(page, side).boundingBox();
  await page.mouse.click(box.x + x * box.width, box.y + y * box.height);
}

/** Places on the liquid, as parts of the picture. */
export const places = Array.from({ length: 10 }, (_, i) => [
  0.16 + 0.05 * (i % 5),
  0.52 + 0.05 * Math.floor(i / 5),
]);

export async function addPairs(page, count) {
  for (const [x, y] of places.slice(0, count)) {
    await click(page, 'source', x, y);
    await click(page, 'target', x, y);
  }
}

/** The editor's pairs, as it keeps them. */
export async function stored(page) {
  const text = await page.evaluate(
    (key) => localStorage.getItem(key),
    `liquidblend.pairs.families/${family}`,
  );
  return JSON.parse(text)?.lists[0];
}

export async function numbers(page) {
  return (await stored(page)).pairs.map(({ number }) => number);
}

export function marker(page, number, side) {
  return page.getByRole('button', { name: new RegExp(`^Pair ${number}, ${side}`) });
}

/** The text of a file that the menu saves. */
export async function download(page, name) {
  await page.getByRole('button', { name: 'File', exact: true }).click();
  const [file] = await Promise.all([
    page.waitForEvent('download'),
    page.getByRole('button', { name, exact: true }).click(),
  ]);
  await page.keyboard.press('Escape');
  return readFileSync(await file.path(), 'utf8');
}

/** Has the menu read a file of pairs. */
export async function upload(page, name, text) {
  await page.getByRole('button', { name: 'File', exact: true }).click();
  const [chooser] = await Promise.all([
    page.waitForEvent('filechooser'),
    page.getByRole('button', { name, exact: true }).click(),
  ]);
  const buffer = Buffer.from(text);
  await chooser.setFiles({ name: 'pairs.json', mimeType: 'application/json', buffer });
  await page.keyboard.press('Escape');
}
