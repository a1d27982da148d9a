import assert from 'node:assert/strict';
import { test } from 'node:test';
import { baseUrl, family, newPage, openViewer, settled } from './page.mjs';

const markup = '<img src=x onerror="globalThis.hacked=1"><script>globalThis.hacked=1</script>';
const long = 'x'.repeat(300);

/** Answers of a server whose names, notes and errors are all hostile. */
async function lie(page) {
  const animation = {
    name: `animations/${markup}`,
    state: 'FAILED',
    error: { code: 3, message: markup },
    notes: [markup],
  };
  const hostile = {
    name: `families/${markup}`,
    version: '1',
    source: animation.name,
    targets: [animation.name],
    durationS: 1,
  };
  await page.route(/\/v1\/animations(\?|$)/, (route) =>
    route.fulfill({ json: { animations: [animation] } }),
  );
  await page.route(/\/v1\/families(\?|$)/, (route) =>
    route.fulfill({ json: { families: [hostile, { ...hostile, name: `families/${long}` }] } }),
  );
  await page.route(/\/v1\/families\/./, (route) =>
    route.fulfill({
      status: 400,
      json: {
        code: 3,
        message: `${markup} is wrong`,
        details: [
          {
            '@type': 'type.googleapis.com/google.rpc.BadRequest',
            fieldViolations: [{ field: markup, description: markup }],
          },
          {
            '@type': 'type.googleapis.com/google.rpc.ErrorInfo',
            reason: markup,
            metadata: { [markup]: markup },
          },
        ],
      },
    }),
  );
}

test('HostileNamesAndErrorsAreText', async () => {
  const page = await newPage();
  try {
    await lie(page);
    await page.goto(`${baseUrl}/`);
    const row = page.getByRole('button', { name: /onerror/ }).first();
    await row.waitFor();
    await row.click();
    const alert = page.getByRole('alert').filter({ hasText: 'is wrong' }).first();
    await alert.waitFor();
    assert.ok((await alert.textContent()).includes(markup));
    assert.equal(await page.evaluate(() => globalThis.hacked), undefined);
    assert.deepEqual(
      await page.evaluate(() => globalThis.violations),
      [],
      'nothing was even tried',
    );
    assert.equal(await page.locator('img').count(), 0);
    assert.ok(
      await page.evaluate(() => document.documentElement.scrollWidth <= innerWidth),
      'long names wrap',
    );
  } finally {
    await page.context().close();
  }
});

test('HostileLinksDoNothing', async () => {
  const page = await newPage();
  try {
    const query = new URLSearchParams({
      family: markup,
      beside: markup,
      cam: markup,
      theme: markup,
      w: markup,
    });
    await page.goto(`${baseUrl}/#view?${query}`);
    await page.getByRole('alert').first().waitFor();
    assert.equal(await page.evaluate(() => globalThis.hacked), undefined);
    assert.deepEqual(await page.evaluate(() => globalThis.violations), []);
  } finally {
    await page.context().close();
  }
});

test('ErrorsHaveTheirDetailsAndGoAwayAgain', async () => {
  const page = await newPage();
  try {
    await openViewer(page, { shade: 'plain' });
    await settled(page);
    await page.route(/frame\.drc/, (route) =>
      route.fulfill({
        status: 400,
        json: {
          code: 11,
          message: 'outside',
          details: [{ '@type': 'type.googleapis.com/google.rpc.RequestInfo', requestId: 'r-1' }],
        },
      }),
    );
    await page.keyboard.press('End');
    const alert = page.locator('lb-pane').getByRole('alert');
    await alert.filter({ hasText: 'outside' }).waitFor();
    assert.match(await alert.textContent(), /r-1/);
    await page.unroute(/frame\.drc/);
    await page.keyboard.press('Home');
    await alert.waitFor({ state: 'hidden' });
  } finally {
    await page.context().close();
  }
});

test('ListsFollowTheirPages', async () => {
  const page = await newPage();
  try {
    const names = Array.from(
      { length: 25 },
      (_, index) => `families/many_${String(index).padStart(2, '0')}`,
    );
    await page.route(/\/v1\/families\?/, (route) => {
      const from = Number(new URL(route.request().url()).searchParams.get('page_token') ?? 0);
      const families = names
        .slice(from, from + 10)
        .map((name) => ({ name, version: '1', durationS: 1 }));
      route.fulfill({
        json: { families, nextPageToken: from + 10 < names.length ? String(from + 10) : '' },
      });
    });
    await page.goto(`${baseUrl}/#view?family=${family}`);
    const rows = page.getByRole('list', { name: 'Families' }).getByRole('listitem');
    await page.getByRole('button', { name: /^many_24/ }).waitFor();
    assert.equal(await rows.count(), 25);
    await page.getByRole('searchbox').fill('MANY_1');
    await page.getByRole('button', { name: /^many_00/ }).waitFor({ state: 'hidden' });
    assert.equal(await rows.count(), 10);
  } finally {
    await page.context().close();
  }
});
