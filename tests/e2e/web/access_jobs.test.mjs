// Pad, editor and jobs without a mouse, for readers of screens, in both themes, on a phone.
import assert from 'node:assert/strict';
import { before, test } from 'node:test';
import { tabStops, violations } from './accessibility.mjs';
import { ensurePadFamily, folderOf } from './library.mjs';
import { baseUrl, newPage } from './page.mjs';

let family;
before(async () => {
  family = await ensurePadFamily();
});

async function addPair(page) {
  await page.waitForFunction(() => {
    const editor = document
      .querySelector('lb-page')
      .shadowRoot.querySelector('lb-editor')?.shadowRoot;
    const panes = [...(editor?.querySelectorAll('lb-edit-pane') ?? [])];
    return panes.length === 2 && panes.every((pane) => pane.ready);
  });
  for (const side of [0, 1]) {
    await page.locator('lb-edit-pane canvas').nth(side).focus();
    await page.keyboard.press('Enter');
  }
  await page.getByRole('button', { name: /^Pair 1, target/ }).focus();
}

/** What is looked at: where it is, and what opens it. */
const views = {
  pad: ['view?family=FAMILY&shade=plain', (page) => page.locator('lb-pad svg').waitFor()],
  'pad outside': [
    'view?family=FAMILY&shade=plain',
    async (page) => {
      await page.getByRole('spinbutton', { name: 'wall_width' }).fill('1.3');
      await page.keyboard.press('Enter');
      await page.locator('lb-pad p.note').filter({ hasText: 'Outside' }).waitFor();
    },
  ],
  editor: ['edit?family=FAMILY', addPair],
  'editor without a family': ['edit', (page) => page.getByText('Choose a family').waitFor()],
  'keys of the editor': [
    'edit?family=FAMILY',
    (page) => page.getByRole('button', { name: 'Keys' }).click(),
  ],
  'files of the editor': [
    'edit?family=FAMILY',
    (page) => page.getByRole('button', { name: 'File', exact: true }).click(),
  ],
  operations: ['jobs?show=operations', (page) => page.getByRole('article').first().waitFor()],
  upload: [
    'jobs?show=upload',
    async (page) => {
      await page.getByLabel('Folder of frames').setInputFiles(folderOf('dam_break_clip/w0_p0'));
      await page.getByRole('button', { name: 'Upload', exact: true }).waitFor();
    },
  ],
  register: [
    'jobs?show=register',
    async (page) => {
      await page.getByText('Options', { exact: true }).click();
      await page.getByRole('button', { name: 'Add a parameter' }).click();
      await page.getByRole('button', { name: 'Add a target' }).click();
      await page.getByRole('button', { name: 'Register', exact: true }).click();
      await page.getByRole('button', { name: 'Remove target 2' }).waitFor();
    },
  ],
  animations: [
    'jobs?show=animations',
    async (page) => {
      await page
        .getByText(/notes? of the import/)
        .first()
        .click();
    },
  ],
  families: [
    'jobs?show=families&family=FAMILY',
    async (page) => {
      await page.getByText('All figures').first().click();
      await page.getByRole('button', { name: 'Delete' }).click();
      await page.getByRole('dialog').waitFor();
    },
  ],
};

for (const theme of ['light', 'dark']) {
  for (const width of [1280, 360]) {
    test(`AxeFindsNothingInPadEditorAndJobs: ${theme}, ${width} px`, async () => {
      for (const [name, [place, open]] of Object.entries(views)) {
        const page = await newPage({ theme, width, height: 740 });
        try {
          await page.goto(`${baseUrl}/#${place.replace('FAMILY', family)}`);
          await open(page);
          await page.waitForTimeout(100);
          assert.deepEqual(await violations(page), [], name);
          const [inner, outer] = await page.evaluate(() => {
            const main = document.querySelector('lb-page').shadowRoot.querySelector('main');
            return [
              main.scrollWidth - main.clientWidth,
              document.documentElement.scrollWidth - innerWidth,
            ];
          });
          assert.ok(
            inner <= 0 && outer <= 0,
            `${name} is wider than the page by ${inner}, ${outer}`,
          );
          assert.deepEqual(await page.evaluate(() => globalThis.violations), [], name);
        } finally {
          await page.context().close();
        }
      }
    });
  }
}

test('TabComesToAllOfTheEditorInOrder', async () => {
  const page = await newPage();
  try {
    await page.goto(`${baseUrl}/#edit?family=${family}`);
    await addPair(page);
    await page.getByRole('link', { name: 'Viewer' }).focus();
    const stops = await tabStops(page);
    const order = [
      /^Target$/,
      /Kind of new pairs/,
      /^Hard$/,
      /^Check pair$/,
      /One camera/,
      /^Undo$/,
      /^File$/,
      /^Fit/,
      /^Keys$/,
      /^source: /,
      /^Pair 1, source/,
      /Time of the source/,
      /^target: /,
      /^Pair 1, target/,
      /Time of the target/,
      /How to register again/,
      /Iterations/,
      /^Register again/,
      /Go to pair 1/,
      /Delete pair 1/,
      /Kind of pair 1/,
    ];
    let at = -1;
    for (const name of order) {
      const next = stops.findIndex((stop, index) => index > at && name.test(stop));
      assert.ok(next > at, `${name} in ${stops.join(' | ')}`);
      at = next;
    }
  } finally {
    await page.context().close();
  }
});

test('TabComesToAllOfThePadAndTheJobs', async () => {
  const page = await newPage();
  try {
    await page.goto(`${baseUrl}/#view?family=${family}&shade=plain`);
    await page.locator('lb-pad svg').waitFor();
    const pad = await tabStops(page);
    for (const name of [/^Point in parameter space/, /^wall_width$/, /^place$/, /Extrapolate/]) {
      assert.ok(
        pad.some((stop) => name.test(stop)),
        `${name} in ${pad.join(' | ')}`,
      );
    }
    await page.goto(`${baseUrl}/#jobs?show=register`);
    await page.getByLabel('Name of the family').waitFor();
    const form = await tabStops(page);
    for (const name of [
      /^Upload$/,
      /Name of the family/,
      /^Source$/,
      /^Target 1$/,
      /Add a parameter/,
      /^Register$/,
    ]) {
      assert.ok(
        form.some((stop) => name.test(stop)),
        `${name} in ${form.join(' | ')}`,
      );
    }
  } finally {
    await page.context().close();
  }
});

test('PairsAreMarkedByTouchAt360Pixels', async () => {
  const page = await newPage({ width: 360, height: 740, hasTouch: true, isMobile: true });
  try {
    await page.goto(`${baseUrl}/#edit?family=${family}`);
    await page.waitForFunction(() => {
      const editor = document
        .querySelector('lb-page')
        .shadowRoot.querySelector('lb-editor')?.shadowRoot;
      const panes = [...(editor?.querySelectorAll('lb-edit-pane') ?? [])];
      return panes.length === 2 && panes.every((pane) => pane.ready);
    });
    for (const side of [0, 1]) {
      const canvas = page.locator('lb-edit-pane canvas').nth(side);
      await canvas.scrollIntoViewIfNeeded();
      const box = await canvas.boundingBox();
      await page.touchscreen.tap(box.x + 0.25 * box.width, box.y + 0.58 * box.height);
    }
    await page.getByRole('button', { name: 'Register again with 1 pair' }).waitFor();
  } finally {
    await page.context().close();
  }
});
