import assert from 'node:assert/strict';
import { test } from 'node:test';
import { counters, newPage, openViewer, until, waitFor } from './page.mjs';

test('ComesBackAfterALostConnection', async () => {
  const page = await newPage();
  try {
    const sockets = [];
    await page.routeWebSocket(/\/v1\/stream/, (socket) => {
      sockets.push(socket);
      socket.connectToServer();
    });
    await openViewer(page, { play: '1', shade: 'plain', w: '0.5', t: '1' });
    await waitFor(page, (pane) => pane.received > 20);
    const before = await counters(page);
    await sockets[0].close({ code: 4429, reason: 'too busy' });
    await until(() => sockets.length === 2);
    await waitFor(page, (pane) => pane.connection === 'open');
    const after = await waitFor(page, (pane) => pane.received > before.received + 20);
    assert.equal(sockets.length, 2);
    assert.equal(after.orderViolations, 0);
    assert.deepEqual(after.lastShown.weights, [0.5]);
  } finally {
    await page.context().close();
  }
});

test('SaysWhyAStreamWasRefused', async () => {
  const page = await newPage();
  try {
    await page.routeWebSocket(/\/v1\/stream/, (socket) =>
      socket.close({ code: 4403, reason: 'no scope <b>frames</b>' }),
    );
    await openViewer(page, { shade: 'plain' });
    await page.getByRole('button', { name: 'Play' }).click();
    const alert = page.locator('lb-pane').getByRole('alert');
    await alert.filter({ hasText: 'no scope <b>frames</b>' }).waitFor();
    assert.equal((await counters(page)).playing, false);
  } finally {
    await page.context().close();
  }
});

test('GivesCreditForEachFrame', async () => {
  const page = await newPage();
  try {
    let sent = 0;
    let isClosed = false;  // after the last message
    await page.routeWebSocket(/\/v1\/stream/, (socket) => {
      const server = socket.connectToServer();
      socket.onMessage((message) => {
        ++sent;
        server.send(message);
      });
      socket.onClose((code, reason) => {
        isClosed = true;
        server.close({ code, reason });
      });
    });
    await openViewer(page, { play: '1', shade: 'plain' });
    await waitFor(page, (pane) => pane.received > 60);
    await page.getByRole('button', { name: 'Pause' }).click();
    const { received } = await waitFor(page, (pane) => pane.connection === 'closed');
    await until(() => isClosed);
    assert.ok(Math.abs(sent - received) <= 8, `${sent} messages for ${received} frames`);
  } finally {
    await page.context().close();
  }
});

test('SendsNothingWhileThePageIsHidden', async () => {
  const page = await newPage();
  try {
    await openViewer(page, { play: '1', shade: 'plain' });
    const hide = (hidden) =>
      page.evaluate((value) => {
        Object.defineProperty(document, 'hidden', { value, configurable: true });
        document.dispatchEvent(new Event('visibilitychange'));
      }, hidden);
    await hide(true);
    await waitFor(page, (pane) => pane.connection === 'closed' && pane.playing);
    await hide(false);
    await waitFor(page, (pane) => pane.connection === 'open');
  } finally {
    await page.context().close();
  }
});
