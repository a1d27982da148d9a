import assert from 'node:assert/strict';
import { test } from 'node:test';
import { ensurePadFamily } from './library.mjs';
import { newPage, openViewer, settled, waitFor } from './page.mjs';

async function picture(page) {
  await settled(page);
  await page.evaluate(() => document.activeElement?.blur());
  return page.locator('canvas').first().screenshot();
}

for (const shade of ['liquid', 'plain']) {
  test(`ReloadGivesTheSamePixels: ${shade}`, async () => {
    const page = await newPage();
    try {
      await openViewer(page, { shade, t: '0.5' });
      const box = await page.locator('canvas').first().boundingBox();
      await page.mouse.move(box.x + box.width / 2, box.y + box.height / 2);
      await page.mouse.down();
      await page.mouse.move(box.x + box.width / 2 + 117, box.y + box.height / 2 + 31, { steps: 5 });
      await page.mouse.up();
      await page.mouse.wheel(0, -240);
      const weight = page.getByRole('slider', { name: /^Weight of/ }).first();
      await weight.focus();
      for (let i = 0; i < 30; ++i) await weight.press('ArrowRight');
      const time = page.getByRole('slider', { name: /^Time of/ });
      await time.focus();
      await time.press('ArrowRight');
      if (shade === 'plain') await page.getByRole('button', { name: 'Wireframe' }).click();
      const withoutPattern = await picture(page);
      await page.getByRole('button', { name: 'Pattern' }).click();
      await waitFor(page, ({ lastShown }) => lastShown?.hasRestPositions);
      const before = await picture(page);
      assert.ok(!before.equals(withoutPattern), 'the pattern is not seen');
      await page.waitForURL(/pattern=1/);
      const url = page.url();
      await page.reload();
      await page.waitForFunction(() => globalThis.liquidblend?.panes[0]?.shown > 0);
      const after = await picture(page);
      assert.equal(page.url(), url);
      assert.match(url, /w=0\.3/);
      assert.match(url, /pattern=1/);
      assert.ok(before.equals(after), 'the pictures differ');
    } finally {
      await page.context().close();
    }
  });
}

test('ALinkGivesTheSamePicture', async () => {
  const first = await newPage({ theme: 'light' });
  const second = await newPage({ theme: 'dark' });
  try {
    await openViewer(first, { t: '0.75', w: '0.5', shade: 'plain' });
    await first.getByRole('button', { name: 'Use the dark theme' }).click();
    await first.waitForURL(/theme=dark/);
    const expected = await picture(first);
    await second.goto(first.url());
    await second.waitForFunction(() => globalThis.liquidblend?.panes[0]?.shown > 0);
    assert.ok(expected.equals(await picture(second)), 'the pictures differ');
  } finally {
    await first.context().close();
    await second.context().close();
  }
});

test('AnotherFamilyBeginsAsItsLinkSays', async () => {
  const other = await ensurePadFamily();
  const page = await newPage();
  try {
    await openViewer(page, { t: '1', w: '0.5', shade: 'plain' });
    await settled(page);
    await page.evaluate((id) => {
      location.hash = `#view?family=${id}&play=1&shade=plain`;
    }, other);
    await waitFor(
      page,
      ({ playing, title, shown }) => playing && title.includes('pad') && shown > 2,
    );
    const { state } = await page.evaluate(() => globalThis.liquidblend);
    assert.equal(state.playing, true);
    assert.equal(state.name, `families/${other}`);
    assert.ok(state.panes[0].timeS < 0.5, 'within the other family, not where the first one was');
    await page.goBack();
    const pane = await waitFor(page, ({ settled, lastShown }) => settled && lastShown?.timeS === 1);
    assert.equal(pane.playing, false);
    assert.deepEqual(page.seen.errors, []);
  } finally {
    await page.context().close();
  }
});
