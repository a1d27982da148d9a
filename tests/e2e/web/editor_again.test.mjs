import assert from 'node:assert/strict';
import { test } from 'node:test';
import {
  addPairs,
  click,
  download,
  family,
  marker,
  numbers,
  places,
  shown,
  stored,
  upload,
  withEditor,
} from './editor_page.mjs';
import { api, refineFamily } from './library.mjs';
import { report, slowness, waitFor } from './page.mjs';

test('CheckPairsChangeNoByteOfTheFamily', () =>
  withEditor(async (page) => {
    const state = async () => {
      const { json } = await api(`/v1/families/${family}`);
      const { response } = await api(`/v1/families/${family}/frame.drc?weights=0.5&time=0.2`);
      return JSON.stringify(json) + Buffer.from(await response.arrayBuffer()).toString('base64');
    };
    const before = await state();
    await page.getByRole('button', { name: 'Check pair', exact: true }).click();
    await addPairs(page, 3);
    await page.getByText(/Mean error of 3 check pairs:/).waitFor();
    const list = page.getByRole('list', { name: 'Check pairs' });
    assert.equal(await list.getByText(/measured/).count(), 3);
    const mean = await page.locator('.mean strong').textContent();
    const box = await marker(page, 2, 'target').boundingBox();
    await page.mouse.move(box.x + box.width / 2, box.y + box.height / 2);
    await page.mouse.down();
    await page.mouse.move(box.x + 60, box.y + 20, { steps: 5 });
    await page.mouse.up();
    await page.waitForFunction((was) => {
      const editor = document
        .querySelector('lb-page')
        .shadowRoot.querySelector('lb-editor').shadowRoot;
      return (
        editor.querySelector('lb-pairs').shadowRoot.querySelector('.mean strong').textContent !==
        was
      );
    }, mean);
    assert.equal(await state(), before);
    await page.getByText('Register again with 0 pairs', { exact: true }).waitFor();
    const posts = page.seen.requests.filter((request) => request.method() === 'POST');
    assert.ok(
      posts.every((request) => request.url().endsWith(':measure')),
      'nothing but measured',
    );
    assert.equal((await download(page, 'Export pairs')).includes('kind'), false);
    assert.equal((await download(page, 'Export check pairs')).match(/"kind"/g).length, 3);
  }));

test('AutomaticPairsAreKeptPinnedOrDropped', () =>
  withEditor(async (page) => {
    const { json } = await api(`/v1/families/${family}`);
    const automatic = json.reports[0].correspondences.filter((one) => one.automatic);
    const found = page.getByRole('list', { name: 'Found by the registration' });
    await found.getByRole('listitem').nth(automatic.length - 1).waitFor();
    assert.equal(await found.getByRole('listitem').count(), automatic.length);
    await found
      .getByText(`confidence ${automatic[0].confidence.toFixed(2)}`)
      .first()
      .waitFor();
    await found.getByRole('button', { name: 'Pin A1', exact: true }).click();
    const { pairs, dropped } = await stored(page);
    assert.deepEqual(
      pairs[0].source.position,
      ['x', 'y', 'z'].map((axis) => automatic[0].correspondence.source.position[axis] ?? 0),
    );
    assert.equal(dropped.length, 1, 'the pinned one takes its place');
    await found.getByRole('button', { name: 'Drop A2', exact: true }).click();
    const others = automatic.length - 2;
    let request;
    await page.route(/\/v1\/families$/, (route) => {
      request = route.request().postDataJSON();
      return route.fulfill({ status: 400, json: { code: 3, message: 'not now' } });
    });
    await page.getByRole('button', { name: /^Register again/ }).click();
    await page.getByRole('alert').filter({ hasText: 'not now' }).waitFor();
    assert.equal(request.options.automaticCorrespondences, false);
    assert.equal(request.correspondences[0].correspondences.length, 1 + others);
    page.seen.errors.length = 0;
  }));

test('MarksOutliveAnotherVersion', () =>
  withEditor(async (page) => {
    await addPairs(page, 2);
    const last = (await numbers(page)).at(-1);
    await marker(page, last, 'source').click({ modifiers: ['Control'] });
    const before = await stored(page);
    assert.equal(before.pairs.at(-1).enabled, false);
    await refineFamily(family);
    await page.reload();
    await shown(page);
    await marker(page, last, 'source').waitFor();
    assert.deepEqual(await numbers(page), before.pairs.map(({ number }) => number));
    assert.deepEqual((await stored(page)).pairs, before.pairs);
  }));

test('TenPairsAreRefinedAndTheirResidualsShown', () =>
  withEditor(async (page) => {
    await addPairs(page, 10);
    assert.deepEqual(await numbers(page), [1, 2, 3, 4, 5, 6, 7, 8, 9, 10]);
    await page.getByRole('button', { name: 'Delete pair 3' }).click();
    await page.getByRole('button', { name: 'Go to pair 4' }).click();
    await page.getByRole('checkbox', { name: 'check' }).check();
    await click(page, 'source', ...places[2]);
    await click(page, 'target', ...places[2]);
    await page.getByLabel('Iterations').fill('2');
    const before = (await api(`/v1/families/${family}`)).json.version;
    let numLost = 0;  // the first watch is
    await page.route(/:watch$/, (route) => (numLost++ ? route.continue() : route.abort()));
    await page.getByRole('button', { name: 'Register again with 9 pairs' }).dblclick();
    await page.getByRole('progressbar', { name: 'Progress of the registration' }).waitFor();
    await page.getByText(/Version \d+ is published/).waitFor({ timeout: 90_000 * slowness });
    const { json } = await api(`/v1/families/${family}`);
    assert.equal(Number(json.version), Number(before) + 1);
    const own = json.reports[0].correspondences.filter((one) => !one.automatic);
    assert.equal(own.length, 9, 'the check pair was not sent');
    const table = page.getByRole('table', { name: 'Pairs before and after' });
    const rows = table.locator('tbody tr');
    await table
      .getByText(/kept|overruled/)
      .first()
      .waitFor();
    const texts = await rows.evaluateAll((all) =>
      all.map((row) => [...row.cells].map((cell) => cell.textContent.trim())),
    );
    const sent = texts.filter(([number]) => number !== '4');
    assert.deepEqual(
      sent.map(([number]) => Number(number)),
      [1, 2, 5, 6, 7, 8, 9, 10, 11],
    );
    sent.forEach(([, , afterwards, outcome], i) => {
      assert.equal(outcome, own[i].outcome === 'OVERRULED' ? 'overruled' : 'kept');
      assert.equal(afterwards, `${(own[i].residualM ?? 0).toFixed(3)} m`);
    });
    assert.equal(texts.find(([number]) => number === '4')[3], 'check');
    report(
      'residuals',
      texts.map((row) => row.join(' ')),
    );
    await page.getByRole('link', { name: /^Compare versions/ }).click();
    await page.waitForFunction(() => globalThis.liquidblend?.panes.length === 2);
    const pane = await waitFor(page, ({ shown }) => shown > 0);
    assert.equal(pane.error, '');
    const { panes } = await page.evaluate(() => globalThis.liquidblend);
    assert.ok(panes.some(({ title }) => title === `version ${before}`));
    assert.ok(numLost > 1);
    page.seen.errors = page.seen.errors.filter((error) => !/ERR_FAILED/.test(error));
  }));

test('RegistersFromScratchWithTheSourceAndTargetsOfBefore', () =>
  withEditor(async (page) => {
    await page.getByRole('button', { name: 'Delete pair 1' }).click();
    await page.getByLabel('How to register again').selectOption('scratch');
    await page.getByRole('checkbox', { name: 'Also find pairs by itself' }).uncheck();
    await page.getByLabel('Iterations').fill('1');
    const { json: before } = await api(`/v1/families/${family}`);
    const { length: numPairs } = await numbers(page);
    await page.getByRole('button', { name: `Register again with ${numPairs} pairs` }).click();
    await page.getByText(/Version \d+ is published/).waitFor({ timeout: 90_000 * slowness });
    const { json } = await api(`/v1/families/${family}`);
    assert.equal(Number(json.version), Number(before.version) + 1);
    assert.deepEqual([json.source, json.targets], [before.source, before.targets]);
    const { correspondences } = json.reports[0];
    assert.equal(correspondences.length, numPairs);
    assert.ok(correspondences.every(({ automatic }) => !automatic));
    await page.getByRole('table', { name: 'Pairs before and after' }).getByText('kept').first()
      .waitFor();
  }));

test('ErrorsOfRegistrationsNameThePairs', () =>
  withEditor(async (page) => {
    const { json } = await api(`/v1/families/${family}`);
    const {
      x: left = 0,
      y = 0,
      z = 0,
    } = json.reports[0].correspondences[0].correspondence.source.position;
    const written = (x) => ({ position: [left + x, y, z], time_s: 0 });
    const pairs = [0, 0.3].map((x) => ({ hard: true, source: written(0), target: written(x) }));
    await upload(page, 'Import pairs', JSON.stringify({ correspondences: [pairs] }));
    await page.getByRole('button', { name: 'Register again with 2 pairs' }).click();
    const [first, second] = await numbers(page);
    await page
      .getByText(`Numbers in messages count from 0: 0 is pair ${first}, 1 is pair ${second}.`)
      .waitFor({ timeout: 60_000 * slowness });
    await page.getByRole('alert').first().waitFor();
  }));
