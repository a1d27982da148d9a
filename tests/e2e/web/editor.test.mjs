import assert from 'node:assert/strict';
import { execFileSync } from 'node:child_process';
import { mkdtempSync, readFileSync, rmSync, writeFileSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import { after, before, test } from 'node:test';
import { api, ensureClips, ensureFamily } from './library.mjs';
import { baseUrl, newPage, report, waitFor } from './page.mjs';

const family = `e2e_edit_${Date.now().toString(36)}`;
let folder;

before(async () => {
  folder = mkdtempSync(join(tmpdir(), 'pairs-'));
  const [source, target] = await ensureClips();
  const options = { maxIterations: 2 };
  await ensureFamily(family, {
    source,
    targets: [target],
    options,
    spaceTime: { coarserLevels: 0 },
  });
});

after(async () => {
  rmSync(folder, { recursive: true, force: true });
  await api(`/v1/families/${family}`, { method: 'DELETE' });
});

/** Does something in the editor, once both animations are shown. */
async function withEditor(act, { fields = {}, ...options } = {}) {
  const page = await newPage(options);
  try {
    await page.goto(`${baseUrl}/#edit?${new URLSearchParams({ family, ...fields })}`);
    await shown(page);
    await act(page);
    assert.deepEqual(page.seen.errors, []);
    assert.deepEqual(await page.evaluate(() => globalThis.violations), []);
  } finally {
    await page.context().close();
  }
}

/** Waits until both pictures show the frames of their cursors. */
async function shown(page) {
  await page.waitForFunction(() => {
    const editor = document
      .querySelector('lb-page')
      ?.shadowRoot.querySelector('lb-editor')?.shadowRoot;
    const panes = [...(editor?.querySelectorAll('lb-edit-pane') ?? [])];
    return panes.length === 2 && panes.every((pane) => pane.ready);
  });
}

function canvas(page, side) {
  return page.locator('lb-edit-pane canvas').nth(side === 'source' ? 0 : 1);
}

/** A click at a part of a picture's width and height. */
async function click(page, side, x, y) {
  const box = await canvas(page, side).boundingBox();
  await page.mouse.click(box.x + x * box.width, box.y + y * box.height);
}

/** Places on the liquid, as parts of the picture. */
const places = Array.from({ length: 10 }, (_, i) => [
  0.16 + 0.05 * (i % 5),
  0.52 + 0.05 * Math.floor(i / 5),
]);

async function addPairs(page, count) {
  for (const [x, y] of places.slice(0, count)) {
    await click(page, 'source', x, y);
    await click(page, 'target', x, y);
  }
}

/** The editor's pairs, as it keeps them. */
async function stored(page) {
  const text = await page.evaluate(
    (key) => localStorage.getItem(key),
    `liquidblend.pairs.families/${family}`,
  );
  return JSON.parse(text)?.lists[0];
}

async function numbers(page) {
  return (await stored(page)).pairs.map(({ number }) => number);
}

function marker(page, number, side) {
  return page.getByRole('button', { name: new RegExp(`^Pair ${number}, ${side}`) });
}

async function download(page, name) {
  await page.getByRole('button', { name: 'File', exact: true }).click();
  const [file] = await Promise.all([
    page.waitForEvent('download'),
    page.getByRole('button', { name, exact: true }).click(),
  ]);
  await page.keyboard.press('Escape');
  return readFileSync(await file.path(), 'utf8');
}

async function upload(page, name, text) {
  const path = join(folder, 'pairs.json');
  writeFileSync(path, text);
  await page.getByRole('button', { name: 'File', exact: true }).click();
  const [chooser] = await Promise.all([
    page.waitForEvent('filechooser'),
    page.getByRole('button', { name, exact: true }).click(),
  ]);
  await chooser.setFiles(path);
  await page.keyboard.press('Escape');
}

test('ClicksAddInTurnOnTheSurface', () =>
  withEditor(async (page) => {
    await click(page, 'source', ...places[0]);
    await page.getByText('target e2e_clip_1: now click here').waitFor();
    await click(page, 'source', ...places[1]);
    assert.equal((await stored(page)).pairs.length, 1, 'the pair waits for its target');
    await click(page, 'target', ...places[0]);
    await click(page, 'source', 0.02, 0.02);
    const { pairs } = await stored(page);
    assert.equal(pairs.length, 1, 'beside the liquid there is nothing to mark');
    const { json } = await api('/v1/animations/e2e_clip_0');
    const { min, max } = json.bounds;
    pairs[0].source.position.forEach((value, i) => {
      const axis = 'xyz'[i];
      assert.ok(value >= min[axis] - 1e-3 && value <= max[axis] + 1e-3);
    });
    await click(page, 'target', ...places[2]);
    await click(page, 'source', ...places[2]);
    assert.deepEqual(await numbers(page), [1, 2], 'either side may be first');
  }));

test('DraggedMarkersStayOnTheSurface', () =>
  withEditor(async (page) => {
    await addPairs(page, 1);
    const before = (await stored(page)).pairs[0];
    const box = await marker(page, 1, 'source').boundingBox();
    await page.mouse.move(box.x + box.width / 2, box.y + box.height / 2);
    await page.mouse.down();
    await page.mouse.move(box.x + box.width / 2 + 40, box.y + box.height / 2 + 12, { steps: 10 });
    await page.mouse.up();
    const { pairs } = await stored(page);
    assert.notDeepEqual(pairs[0].source.position, before.source.position);
    assert.deepEqual(pairs[0].target, before.target);
    const moved = await marker(page, 1, 'source').boundingBox();
    assert.ok(
      Math.abs(moved.x - box.x - 40) < 2 && Math.abs(moved.y - box.y - 12) < 2,
      'where it was let go',
    );
    await page.keyboard.press('Control+z');
    assert.deepEqual((await stored(page)).pairs[0], before, 'a drag is one step');
    await page.mouse.move(box.x + box.width / 2, box.y + box.height / 2);
    await page.mouse.down();
    await page.mouse.move(5, 5, { steps: 5 });
    await page.mouse.up();
    const { pairs: left } = await stored(page);
    assert.equal(left.length, 1, 'leaving the picture makes nothing');
  }));

test('MarkersKeepTheirSizeAndFade', () =>
  withEditor(async (page) => {
    await addPairs(page, 1);
    const mark = marker(page, 1, 'source');
    const before = await mark.locator('.body').boundingBox();
    await canvas(page, 'source').focus();
    for (let i = 0; i < 4; ++i) await page.keyboard.press('+');
    const zoomed = await mark.locator('.body').boundingBox();
    assert.ok(Math.abs(zoomed.width - before.width) < 0.5);
    assert.notEqual(Math.round(zoomed.x), Math.round(before.x));
    await page.getByRole('button', { name: 'Go to pair 1' }).focus();
    await page.keyboard.press('Control+z');
    await page.keyboard.press('Control+Shift+z');
    await click(page, 'source', ...places[3]);
    await page.getByLabel('Time of the source').press('End');
    assert.ok(Number(await mark.getAttribute('opacity')) < 0.5, 'far from the cursor in time');
    await page.getByLabel('Time of the source').press('Home');
    assert.equal(Number(await mark.getAttribute('opacity')), 1);
  }));

test('DeletionKeepsTheNumbersOfTheOthers', () =>
  withEditor(async (page) => {
    await addPairs(page, 4);
    await page.getByRole('button', { name: 'Delete pair 2' }).click();
    assert.deepEqual(await numbers(page), [1, 3, 4]);
    await marker(page, 3, 'source').focus();
    await page.keyboard.press('Delete');
    assert.deepEqual(await numbers(page), [1, 4]);
    await click(page, 'source', ...places[6]);
    await click(page, 'target', ...places[6]);
    assert.deepEqual(await numbers(page), [1, 4, 5]);
    assert.equal(await marker(page, 4, 'target').locator('text').textContent(), '4');
    await page.keyboard.press('Control+z');
    await page.keyboard.press('Control+z');
    await page.keyboard.press('Control+z');
    assert.deepEqual(await numbers(page), [1, 3, 4]);
  }));

test('FiftyStepsAreUndoneAndDoneAgain', () =>
  withEditor(async (page) => {
    const states = [];
    const step = async (act) => {
      await act();
      states.push(JSON.stringify(await stored(page)));
    };
    for (const [x, y] of places) {
      await step(() => click(page, 'source', x, y));
      await step(() => click(page, 'target', x, y));
    }
    for (let i = 1; i <= 10; ++i) {
      await step(async () => {
        await marker(page, i, 'source').focus();
        await page.keyboard.press('ArrowRight');
      });
      await step(() => page.keyboard.press('h'));
      await step(() => page.keyboard.press('x'));
    }
    for (let i = 0; i < 2; ++i) await step(() => page.keyboard.press('t'));
    assert.equal(states.length, 52);
    assert.equal(new Set(states).size, 52, 'each step changed something');
    for (let i = states.length - 2; i >= 0; --i) {
      await page.keyboard.press('Control+z');
      assert.equal(JSON.stringify(await stored(page)), states[i]);
    }
    for (let i = 1; i < states.length; ++i) {
      await page.keyboard.press(i % 2 ? 'Control+Shift+z' : 'Control+y');
      assert.equal(JSON.stringify(await stored(page)), states[i]);
    }
  }));

test('ControlClickSwitchesPairsOffAndOn', () =>
  withEditor(async (page) => {
    await addPairs(page, 2);
    await marker(page, 1, 'target').click({ modifiers: ['Control'] });
    assert.deepEqual(
      (await stored(page)).pairs.map(({ enabled }) => enabled),
      [false, true],
    );
    await page.getByText('Register again with 1 pair', { exact: true }).waitFor();
    await marker(page, 1, 'target').click({ modifiers: ['Control'] });
    assert.deepEqual(
      (await stored(page)).pairs.map(({ enabled }) => enabled),
      [true, true],
    );
  }));

test('TrajectoriesAreDrawnThroughTime', () =>
  withEditor(async (page) => {
    await page.getByLabel('Kind of new pairs').selectOption('TRAJECTORY');
    await addPairs(page, 1);
    const pane = page.locator('lb-edit-pane').first();
    await pane.locator('polyline.path').waitFor({ timeout: 20_000 });
    const points = (await pane.locator('polyline.path').getAttribute('points')).trim().split(' ');
    assert.ok(points.length >= 3, `${points}`);
    const start = await marker(page, 1, 'source').getAttribute('transform');
    for (let i = 0; i < 4; ++i) await page.keyboard.press('.');
    assert.notEqual(
      await marker(page, 1, 'source').getAttribute('transform'),
      start,
      'it moves with the liquid',
    );
    await page.keyboard.press('e');
    const { lengthS } = (await stored(page)).pairs[0];
    assert.ok(Math.abs(lengthS - 4 / 24) < 1e-4, `${lengthS}`);
  }));

const written = `{"correspondences": [
  [
    {"kind":"space","hard":false,"source":{"position":[-2.0,-0.1,-0.5],"time_s":0.0},"target":{"position":[-2.0,-1e-05,-0.4000000000000001],"time_s":0.0},"length_s":0.25},
    {"kind":"point","hard":true,"source":{"position":[-1.5,0.0,-0.3],"time_s":0.041666666666666664},"target":{"position":[-1.25,0.0,-0.3],"time_s":0.0},"length_s":0.0}]]}
`;
const byHand = `// Two pairs, by hand.
{ "correspondences": [[
  {"source": {"position": [-2, 0, -0.5], "time_s": 0}, "target": {"position": [-2, 0, -0.5], "time_s": 0}}, /* more to come */
  {"kind": "trajectory", "length_s": 0.2, "source": {"position": [-1.5, 0, -0.5], "time_s": 0}, "target": {"position": [-1.4, 0, -0.5], "time_s": 0.1}}
]] }`;

test('FilesComeBackByteForByte', () =>
  withEditor(async (page) => {
    for (const text of [written, byHand]) {
      await upload(page, 'Import pairs', text);
      await page.waitForFunction(
        (key) => JSON.parse(localStorage.getItem(key))?.lists[0].pairs.length === 2,
        `liquidblend.pairs.families/${family}`,
      );
      assert.equal(await download(page, 'Export pairs'), text);
    }
    await page.getByRole('button', { name: 'Go to pair 1' }).click();
    await page.getByRole('checkbox', { name: 'hard' }).check();
    const changed = await download(page, 'Export pairs');
    assert.match(changed, /^\{"correspondences": \[\n {2}\[\n {4}\{"kind":"point","hard":true,/);
    await upload(page, 'Import pairs', '{"correspondences": [[{"sauce": 1}]]}');
    await page.getByRole('alert').filter({ hasText: 'unknown key "sauce"' }).waitFor();
    assert.deepEqual(await numbers(page), [1, 2], 'a wrong file changes nothing');
  }));

const cli = process.env.LIQUIDBLEND_CLI;

test('TheCommandLinesFileComesBackByteForByte', { skip: !cli }, () =>
  withEditor(async (page) => {
    const path = join(folder, 'cli.json');
    execFileSync(cli, ['inspect', family, '--correspondences-json', path], { stdio: 'ignore' });
    const text = readFileSync(path, 'utf8');
    await upload(page, 'Import pairs', text);
    await page.waitForFunction(
      (key) => !!localStorage.getItem(key),
      `liquidblend.pairs.families/${family}`,
    );
    assert.equal(await download(page, 'Export pairs'), text);
    if (!(await numbers(page)).length) return;
    await page
      .getByRole('button', { name: /^Go to pair/ })
      .first()
      .click();
    await page.getByRole('checkbox', { name: 'hard' }).check();
    await page.getByRole('checkbox', { name: 'hard' }).uncheck();
    assert.equal(await download(page, 'Export pairs'), text, 'written anew it is the same');
  }),
);

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
    await page.getByRole('button', { name: 'Register again with 9 pairs' }).click();
    await page.getByRole('progressbar', { name: 'Progress of the registration' }).waitFor();
    await page.getByText(/Version \d+ is published/).waitFor({ timeout: 90_000 });
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
  }));

test('ReloadKeepsWhatWasMarked', () =>
  withEditor(async (page) => {
    await addPairs(page, 2);
    const before = await stored(page);
    await page.reload();
    await shown(page);
    await marker(page, 2, 'source').waitFor();
    assert.deepEqual(await stored(page), before);
  }));

test('KeysAloneMarkAPair', () =>
  withEditor(async (page) => {
    await canvas(page, 'source').focus();
    for (let i = 0; i < 3; ++i) await page.keyboard.press('Shift+ArrowLeft');
    await page.keyboard.press('Enter');
    await canvas(page, 'target').focus();
    await page.keyboard.press('Enter');
    const { pairs } = await stored(page);
    assert.equal(pairs.length > 0 && !!pairs.at(-1).target, true);
    const { number } = pairs.at(-1);
    await marker(page, number, 'source').focus();
    await page.keyboard.press('ArrowRight');
    await page.keyboard.press('Shift+ArrowDown');
    const moved = (await stored(page)).pairs.at(-1);
    assert.notDeepEqual(moved.source.position, pairs.at(-1).source.position);
    await page.keyboard.press('h');
    await page.keyboard.press('c');
    assert.deepEqual(
      [(await stored(page)).pairs.at(-1).hard, (await stored(page)).pairs.at(-1).check],
      [true, true],
    );
    await page.keyboard.press('?');
    await page.getByRole('dialog', { name: 'Keys of the editor' }).waitFor();
    await page.keyboard.press('Escape');
    await page.keyboard.press('.');
    await page.waitForURL(/[&?]t=0\.0417/);
    await page.keyboard.press('Delete');
    assert.equal((await numbers(page)).includes(number), false);
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
    await page
      .getByText('Numbers in messages count from 0: 0 is pair 1, 1 is pair 2.')
      .waitFor({ timeout: 60_000 });
    await page.getByRole('alert').first().waitFor();
  }));
