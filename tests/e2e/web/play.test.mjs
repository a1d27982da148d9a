import assert from 'node:assert/strict';
import { test } from 'node:test';
import {
  assertTime,
  counters,
  newPage,
  openViewer,
  report,
  sizeCanvas,
  until,
  waitFor,
} from './page.mjs';

const seconds = 5;

/** Changes the weight in each animation frame, as a person's pointer would. */
async function sweep(page) {
  await page
    .getByRole('slider', { name: /^Weight of/ })
    .first()
    .evaluate((slider) => {
      const step = (now) => {
        slider.value = String(0.5 + 0.5 * Math.sin(now / 500));
        slider.dispatchEvent(new Event('input', { bubbles: true, composed: true }));
        globalThis.sweeping = requestAnimationFrame(step);
      };
      requestAnimationFrame(step);
    });
}

async function play(fields) {
  const page = await newPage();
  try {
    await openViewer(page, { play: '1', shade: 'plain', ...fields });
    await sizeCanvas(page, 800, 500);
    await sweep(page);
    await page.waitForTimeout(1500);
    const before = await counters(page);
    await page.waitForTimeout(seconds * 1000);
    const after = await counters(page);
    const passed = (after.nowMs - before.nowMs) / 1000;
    return {
      shown: (after.shown - before.shown) / passed,
      decoded: (after.decoded - before.decoded) / passed,
      received: (after.received - before.received) / passed,
      orderViolations: after.orderViolations,
      mainMs: after.mainMs,
      decodeMs: after.decodeMs,
      pixelRatio: after.pixelRatio,
      level: after.lastShown.levelOfDetail,
      vertices: after.lastShown.vertices,
      canvas: await page.locator('canvas').first().boundingBox(),
    };
  } finally {
    await page.context().close();
  }
}

test('PlaysWhileWeightsChangeEveryFrame', async () => {
  const figures = await play({ level: '0' });
  report('play', figures);
  assert.equal(figures.orderViolations, 0);
  assertTime(figures.shown >= 30, `${figures.shown} frames a second were shown`);
  assertTime(figures.mainMs.mean < 6, `${figures.mainMs.mean} ms a frame on the main thread`);
});

// LARGE_FAMILY: one of 50,000 vertices or so.
const largeFamily = process.env.LARGE_FAMILY ?? '';

test(
  'ReportsTheRateOfALargeFamily',
  { skip: !largeFamily && 'LARGE_FAMILY is not set' },
  async () => {
    const figures = await play({ family: largeFamily, level: '0' });
    report('play, large', figures);
    assert.equal(figures.orderViolations, 0);
    assert.ok(figures.shown > 0);
  },
);

test('PlaysLiquidShading', async () => {
  const figures = await play({ shade: 'liquid' });
  report('play, liquid', figures);
  assert.equal(figures.orderViolations, 0);
  assert.ok(figures.shown > 0);
});

test('FollowsTheWeightsThatWereAskedFor', async () => {
  const page = await newPage();
  try {
    await openViewer(page, { play: '1', shade: 'plain' });
    const slider = page.getByRole('spinbutton', { name: /^Weight of/ }).first();
    await slider.fill('0.75');
    await slider.press('Enter');
    await waitFor(
      page,
      (pane) => pane.playing && Math.abs(pane.lastShown.weights[0] - 0.75) < 1e-9,
    );
  } finally {
    await page.context().close();
  }
});

/** Keeps the time of the shown frame in each animation frame from now on, in `times`. */
function recordTimes(page) {
  return page.evaluate(() => {
    const times = (globalThis.times = []);
    const look = () => {
      times.push(globalThis.liquidblend.panes[0].lastShown.timeS);
      requestAnimationFrame(look);
    };
    look();
  });
}

test('LoopsARange', async () => {
  const page = await newPage();
  try {
    await openViewer(page, {
      play: '1',
      loop: 'range',
      range: '0.5,0.8',
      shade: 'plain',
      t: '0.5',
    });
    const begin = await counters(page);
    await recordTimes(page);
    await waitFor(page, (pane) => pane.shown > begin.shown + 10);
    const times = await until(async () => {
      const seen = await page.evaluate(() => globalThis.times);
      const numWraps = seen.filter((time, index) => index && time < seen[index - 1]).length;
      return numWraps >= 3 && seen;
    });
    assert.ok(
      Math.min(...times) >= 0.499 && Math.max(...times) <= 0.801,
      `${Math.min(...times)} to ${Math.max(...times)}`,
    );
  } finally {
    await page.context().close();
  }
});

test('StopsAtTheEndOfAnAnimationThatIsPlayedOnce', async () => {
  const page = await newPage();
  try {
    await openViewer(page, { play: '1', loop: 'off', shade: 'plain' });
    const end = await waitFor(page, (pane) => !pane.playing && pane.settled && pane.timeS > 2.9);
    await recordTimes(page);
    await page.getByRole('button', { name: 'Play' }).click();
    await waitFor(page, (pane) => pane.received > end.received);
    await until(() => page.evaluate(() => globalThis.times.some((timeS) => timeS < 2)));
  } finally {
    await page.context().close();
  }
});
