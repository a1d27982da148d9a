import assert from 'node:assert/strict';
import { test } from 'node:test';
import { gzipSync } from 'node:zlib';
import { assertTime, baseUrl, newPage, report, waitFor } from './page.mjs';

test('FirstVisitIsSmallAndSoonMoves', async () => {
  const page = await newPage();
  try {
    const files = [];
    page.on('response', (response) => {
      const { pathname } = new URL(response.url());
      if (!pathname.startsWith('/v1/')) files.push(response);
    });
    await page.goto(`${baseUrl}/`);
    await waitFor(page, (pane) => pane.playing && pane.shown >= 2);
    const movingMs = await page.evaluate(() => performance.now());
    const names = new Set();
    let compressed = 0;
    for (const response of files) {
      if (names.has(response.url())) continue;
      names.add(response.url());
      compressed += gzipSync(await response.body(), { level: 9 }).length;
    }
    report('first visit', { movingMs, compressed, files: names.size });
    assert.ok(compressed <= 400_000, `${compressed} bytes`);
    assertTime(movingMs <= 3000, `${movingMs} ms`);
  } finally {
    await page.context().close();
  }
});

test('NothingForeign', async () => {
  const page = await newPage();
  try {
    await page.context().route(
      (url) => !url.href.startsWith(`${baseUrl}/`) && url.protocol !== 'blob:',
      (route) => route.abort(),
    );
    await page.goto(`${baseUrl}/`);
    await waitFor(page, (pane) => pane.playing && pane.shown >= 5);
    await page.getByRole('button', { name: 'Plain' }).click();
    await page.getByRole('button', { name: 'Wireframe' }).click();
    await page.getByRole('button', { name: 'Pause' }).click();
    await page.getByRole('button', { name: 'Download' }).click();
    await page.keyboard.press('Escape');
    await waitFor(page, (pane) => pane.settled);
    const { foreign, violations } = page.seen;
    report('foreign', { requests: page.seen.requests.length, foreign, violations });
    assert.deepEqual(foreign, []);
    assert.deepEqual(violations, []);
    assert.deepEqual(await page.evaluate(() => globalThis.violations), []);
  } finally {
    await page.context().close();
  }
});

test('ThePolicyIsStrict', async () => {
  const response = await fetch(`${baseUrl}/`);
  const policy = response.headers.get('content-security-policy') ?? '';
  assert.match(policy, /default-src 'none'/);
  assert.match(policy, /script-src 'self' 'wasm-unsafe-eval'(;|$)/);
  assert.doesNotMatch(policy, /unsafe-inline|'unsafe-eval'/);
});
