import assert from 'node:assert/strict';
import { test } from 'node:test';
import { tabStops, violations } from './accessibility.mjs';
import { baseUrl, counters, family, newPage, openViewer, settled, waitFor } from './page.mjs';

/** The parts of the page that open only when asked to. */
const openers = {
  viewer: async () => {},
  range: (page) => page.getByLabel('Loop').selectOption('range'),
  'beyond the inputs': async (page) => {
    await page
      .getByRole('spinbutton', { name: /^Weight/ })
      .first()
      .fill('1.5');
    await page
      .getByRole('spinbutton', { name: /^Weight/ })
      .first()
      .press('Enter');
  },
  'side by side': (page) => page.getByRole('button', { name: 'Side by side' }).click(),
  download: (page) => page.getByRole('button', { name: 'Download' }).click(),
  keys: (page) => page.getByRole('button', { name: 'Keys' }).click(),
  token: (page) => page.getByRole('button', { name: 'Token' }).click(),
};

for (const theme of ['light', 'dark']) {
  for (const width of [1280, 360]) {
    test(`AxeFindsNothing: ${theme}, ${width} px`, async () => {
      for (const [name, open] of Object.entries(openers)) {
        const page = await newPage({ theme, width, height: 740 });
        try {
          await openViewer(page, { shade: 'plain', w: '0.5' });
          await open(page);
          await page.waitForTimeout(100);
          assert.deepEqual(await violations(page), [], name);
        } finally {
          await page.context().close();
        }
      }
    });
  }
}

test('AxeFindsNothingInAnErrorAndAnEmptyPage', async () => {
  const page = await newPage();
  try {
    await page.goto(`${baseUrl}/#view?family=there_is_no_such_family`);
    await page.getByRole('alert').first().waitFor();
    assert.deepEqual(await violations(page), []);
  } finally {
    await page.context().close();
  }
});

test('KeyboardReachesEverything', async () => {
  const page = await newPage();
  try {
    await openViewer(page, { shade: 'plain' });
    const stops = await tabStops(page);
    const expected = [
      /Token/,
      /theme/,
      /Search/,
      new RegExp(`^${family}`),
      /Liquid/,
      /Plain/,
      /Wireframe/,
      /Level of detail/,
      /Side by side/,
      /Fit/,
      /Download/,
      /Keys/,
      /Picture of/,
      /Play/,
      /Time of/,
      /Speed/,
      /Loop/,
      /Frames per second/,
      /Weight of .*number/,
      /Weight of/,
    ];
    for (const name of expected)
      assert.ok(
        stops.some((stop) => name.test(stop)),
        `${name} in ${stops.join(' | ')}`,
      );
  } finally {
    await page.context().close();
  }
});

test('KeyboardAloneDoesEverything', async () => {
  const page = await newPage();
  try {
    await page.goto(`${baseUrl}/#view`);
    await page.getByRole('button', { name: new RegExp(`^${family}`) }).focus();
    await page.keyboard.press('Enter');
    await waitFor(page, (pane) => pane.playing && pane.shown > 1);
    await page.locator('canvas').first().focus();
    await page.keyboard.press(' ');
    await waitFor(page, (pane) => !pane.playing);
    const urlHas = (field) => page.waitForURL((url) => field.test(url.href));
    await page.keyboard.press('ArrowLeft');
    await page.keyboard.press('Shift+ArrowUp');
    await page.keyboard.press('+');
    await urlHas(/cam=/);
    await page.keyboard.press('f');
    await urlHas(/^((?!cam=).)*$/);
    await page.keyboard.press('Home');
    await page.keyboard.press('.');
    const { timeS } = await counters(page);
    assert.ok(Math.abs(timeS - 1 / 24) < 1e-3, `${timeS}`);
    await page.keyboard.press('s');
    await page.keyboard.press('w');
    await page.keyboard.press('[');
    await page.keyboard.press('End');
    await page.keyboard.press(']');
    for (const field of [/shade=plain/, /wire=1/, /loop=range/, /range=0\.0417,2\.9583/])
      await urlHas(field);
    await page
      .getByRole('slider', { name: /^Weight/ })
      .first()
      .focus();
    await page.keyboard.press('ArrowRight');
    await urlHas(/w=0\.01/);
    await page.keyboard.press('d');
    await page.getByRole('dialog').waitFor();
    await page.keyboard.press('Escape');
    await page.getByRole('dialog').waitFor({ state: 'hidden' });
    await page.getByRole('button', { name: 'Side by side' }).focus();
    await page.keyboard.press('Enter');
    await page.getByRole('checkbox', { name: 'Cameras' }).waitFor();
    await page.keyboard.press('Escape');
    await page.getByRole('checkbox', { name: 'Cameras' }).waitFor({ state: 'hidden' });
    await settled(page);
  } finally {
    await page.context().close();
  }
});

test('IsUsableAt360Pixels', async () => {
  const page = await newPage({ width: 360, height: 740, hasTouch: true, isMobile: true });
  try {
    await openViewer(page, { shade: 'plain' });
    const widths = await page.evaluate(() => [document.documentElement.scrollWidth, innerWidth]);
    assert.ok(widths[0] <= 360 && widths[1] === 360, `${widths}`);
    const canvas = await page.locator('canvas').first().boundingBox();
    assert.ok(canvas.width >= 340 && canvas.height >= 250, JSON.stringify(canvas));
    const main = page.locator('main');
    assert.ok(await main.evaluate((element) => element.scrollWidth <= element.clientWidth));
    await page.getByRole('button', { name: 'Lists' }).tap();
    await page.getByRole('button', { name: new RegExp(`^${family}`) }).tap();
    await waitFor(page, (pane) => pane.playing);
    await page.getByRole('button', { name: 'Pause' }).tap();
    await waitFor(page, (pane) => !pane.playing);
    await page
      .getByRole('slider', { name: /^Weight/ })
      .first()
      .scrollIntoViewIfNeeded();
  } finally {
    await page.context().close();
  }
});
