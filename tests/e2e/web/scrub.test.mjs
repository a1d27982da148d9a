import assert from 'node:assert/strict';
import { test } from 'node:test';
import { assertTime, counters, newPage, openViewer, report, settled, waitFor } from './page.mjs';

const numSeeks = 200;
const durationMs = 2000;

/** Counts requests for frames that are under way at the same time. */
function countRequests(page) {
  const open = new Set();
  const counts = { sent: 0, most: 0, ended: 0 };
  const isFrame = (request) => request.url().includes('/frame.drc');
  page.on('request', (request) => {
    if (!isFrame(request)) return;
    open.add(request);
    ++counts.sent;
    counts.most = Math.max(counts.most, open.size);
  });
  page.on('requestfinished', (request) => open.delete(request));
  page.on('requestfailed', (request) => {
    if (open.delete(request)) ++counts.ended;
  });
  return counts;
}

/** Moves the thumb to and fro by the mouse. Returns when it was released. */
async function scrub(page, box) {
  const y = box.y + box.height / 2;
  const at = (share) => box.x + 12 + share * (box.width - 24);
  await page.mouse.move(at(0.1), y);
  await page.mouse.down();
  const begin = Date.now();
  const moves = [];
  for (let i = 1; i <= numSeeks; ++i) {
    moves.push(page.mouse.move(at(0.5 + 0.45 * Math.sin(i * 0.7)), y));
    const ahead = begin + (i * durationMs) / numSeeks - Date.now();
    if (ahead > 0) await new Promise((resolve) => setTimeout(resolve, ahead));
  }
  await Promise.all([...moves, page.mouse.up()]);
  return Date.now() - begin;
}

async function scrubWhile(fields, check) {
  const page = await newPage();
  try {
    await openViewer(page, { shade: 'plain', ...fields });
    const counts = countRequests(page);
    const slider = page.getByRole('slider', { name: /^Time of/ });
    await page.evaluate(() => {
      addEventListener('pointerup', () => (globalThis.releasedMs = performance.now()), true);
    });
    const tookMs = await scrub(page, await slider.boundingBox());
    await check(page, slider, counts, tookMs);
  } finally {
    await page.context().close();
  }
}

test('ShowsTheFrameWhereTheThumbWasLeft', () =>
  scrubWhile({}, async (page, slider, counts, tookMs) => {
    const wanted = Number(await slider.inputValue());
    await settled(page);
    const after = await counters(page);
    const { atMs } = await page.evaluate((timeS) => {
      const { lastShown } = globalThis.liquidblend.panes[0];
      return {
        atMs:
          Math.abs(lastShown.timeS - timeS) < 1e-3 ? lastShown.atMs - globalThis.releasedMs : NaN,
      };
    }, wanted);
    report('scrub', { tookMs, lastShownAfterMs: atMs, ...counts, shown: after.shown, wanted });
    assert.ok(
      Math.abs(after.lastShown.timeS - wanted) < 1e-3,
      `${after.lastShown.timeS} for ${wanted}`,
    );
    assertTime(atMs <= 150, `${atMs} ms after the release`);
    assert.equal(after.orderViolations, 0);
    assert.ok(after.mostWaiting <= 1);
    assert.ok(counts.most <= 2, `${counts.most} requests at a time`);
  }));

test('PlaysOnFromWhereTheThumbWasLeft', () =>
  scrubWhile({ play: '1' }, async (page, slider, counts) => {
    const before = await counters(page);
    assert.equal(before.playing, true);
    const after = await waitFor(
      page,
      (pane) => pane.connection === 'open' && pane.playing && pane.received > before.received,
    );
    assert.equal(after.orderViolations, 0);
    assert.ok(counts.most <= 2, `${counts.most} requests at a time`);
  }));

test('HoldsThePlaybackWhileTheThumbIsHeld', async () => {
  const page = await newPage();
  try {
    await openViewer(page, { play: '1', shade: 'plain' });
    const box = await page.getByRole('slider', { name: /^Time of/ }).boundingBox();
    await page.mouse.move(box.x + box.width / 2, box.y + box.height / 2);
    await page.mouse.down();
    await waitFor(page, (pane) => pane.connection === 'closed');
    const slider = page.getByRole('slider', { name: /^Time of/ });
    const held = await slider.inputValue();
    await page.waitForTimeout(700);
    assert.equal(await slider.inputValue(), held, 'the thumb does not follow frames');
    assert.equal((await counters(page)).connection, 'closed');
    await page.mouse.up();
    await waitFor(page, (pane) => pane.connection === 'open');
  } finally {
    await page.context().close();
  }
});

test('GoesOnAfterThePressOfAThumbThatDidNotMove', async () => {
  const page = await newPage();
  try {
    await openViewer(page, { shade: 'plain' });
    await settled(page);
    const slider = page.getByRole('slider', { name: /^Time of/ });
    await slider.dispatchEvent('pointerdown');
    await slider.dispatchEvent('pointerup');
    await page.getByRole('button', { name: 'Play' }).click();
    await waitFor(page, (pane) => pane.connection === 'open' && pane.received > 5);
  } finally {
    await page.context().close();
  }
});
