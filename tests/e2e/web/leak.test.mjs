import assert from 'node:assert/strict';
import { test } from 'node:test';
import { counters, newPage, openViewer, report, settled, slowness } from './page.mjs';

// LEAK_FRAMES=10000 is the whole test.
const numFrames = Number(process.env.LEAK_FRAMES ?? 1000);
const numWarmUp = Math.max(600, numFrames / 10);  // until the heap has stopped growing

async function heapBytes(session) {
  await session.send('HeapProfiler.collectGarbage');
  await session.send('HeapProfiler.collectGarbage');
  return (await session.send('Runtime.getHeapUsage')).usedSize;
}

async function untilShown(page, frames) {
  await page.waitForFunction((wanted) => globalThis.liquidblend.panes[0].shown >= wanted, frames, {
    timeout: (20_000 + 500 * (numWarmUp + numFrames)) * slowness,
    polling: 250,
  });
}

test('KeepsItsMemory', async () => {
  const page = await newPage({ width: 480, height: 400 });
  try {
    await openViewer(page, { play: '1', shade: 'plain', rate: '2', level: '1' });
    const session = await page.context().newCDPSession(page);
    await untilShown(page, (await counters(page)).shown + numWarmUp);
    const before = await counters(page);
    const heapBefore = await heapBytes(session);
    await untilShown(page, before.shown + numFrames);
    const after = await counters(page);
    const heapAfter = await heapBytes(session);
    report('leak', {
      frames: after.shown - before.shown,
      decoded: after.decoded - before.decoded,
      heapBefore,
      heapAfter,
      renderer: after.renderer,
      buffersMade: after.buffersMade,
    });
    assert.deepEqual(after.renderer, before.renderer);
    assert.ok(heapAfter <= 1.1 * heapBefore, `${heapBefore} to ${heapAfter} bytes`);
    assert.ok(after.buffersMade <= 8);
  } finally {
    await page.context().close();
  }
});

test('KeepsItsMemoryWhileFamiliesAreOpenedAgain', async () => {
  const page = await newPage({ width: 900, height: 600 });
  try {
    await openViewer(page, { shade: 'liquid' });
    await settled(page);  // what draws a still picture has been made
    let before;
    for (let i = 0; i < 5; ++i) {
      await page.evaluate(
        (time) => {
          location.hash = location.hash.replace(/&t=[^&]*|$/, `&t=${time}`);
        },
        0.1 * (i + 1),
      );
      await settled(page);
      before ??= await counters(page);
    }
    const after = await counters(page);
    assert.ok(Math.abs(after.timeS - 0.5) < 1e-6);
    assert.deepEqual(after.renderer, before.renderer);
  } finally {
    await page.context().close();
  }
});
