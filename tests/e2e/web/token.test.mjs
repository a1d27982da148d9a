import assert from 'node:assert/strict';
import { test } from 'node:test';
import { baseUrl, counters, newPage, token, waitFor } from './page.mjs';

const skip = token ? false : 'TOKEN is not set';

test('TokenOpensPageAndStreamsAndStandsNowhere', { skip }, async () => {
  const page = await newPage({ withoutToken: true });
  try {
    const sockets = [];
    page.on('websocket', (socket) => sockets.push(socket.url()));
    await page.goto(`${baseUrl}/`);
    const dialog = page.getByRole('dialog');
    await dialog.waitFor();
    await dialog.getByLabel('Token').fill('wrong');
    await dialog.getByRole('button', { name: 'Use' }).click();
    await page.getByRole('alert').first().waitFor();
    await dialog.waitFor();
    await dialog.getByLabel('Token').fill(token);
    await page.keyboard.press('Enter');
    await waitFor(page, (pane) => pane.playing && pane.received > 20);
    const urls = [...page.seen.requests.map((request) => request.url()), ...sockets, page.url()];
    const hidden = [token, encodeURIComponent(token), Buffer.from(token).toString('base64url')];
    for (const text of hidden) {
      assert.ok(!urls.some((url) => url.includes(text)), 'in a URL');
      assert.ok(!page.seen.errors.some((line) => line.includes(text)), 'in the console');
    }
    const kept = await page.evaluate(() => [
      JSON.stringify(localStorage),
      document.cookie,
      document.documentElement.outerHTML,
      JSON.stringify(history.state),
    ]);
    for (const text of hidden) assert.ok(!kept.some((store) => store.includes(text)), 'kept');
    await page.reload();
    await waitFor(page, (pane) => pane.playing && pane.shown > 2);
    assert.equal((await counters(page)).error, '');
  } finally {
    await page.context().close();
  }
});

test('TokenIsForgottenWithItsTab', { skip }, async () => {
  const page = await newPage();
  try {
    await page.goto(`${baseUrl}/`);
    await waitFor(page, (pane) => pane.shown > 0);
    const other = await page.context().browser().newContext();
    const fresh = await other.newPage();
    await fresh.goto(`${baseUrl}/`);
    await fresh.getByRole('dialog').waitFor();
    await other.close();
  } finally {
    await page.context().close();
  }
});
