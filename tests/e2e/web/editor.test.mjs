import assert from 'node:assert/strict';
import { execFileSync } from 'node:child_process';
import { mkdtempSync, readFileSync, rmSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import { after, before, test } from 'node:test';
import {
  addPairs,
  canvas,
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
import { api } from './library.mjs';
import { drawn, slowness } from './page.mjs';

let folder;

before(() => {
  folder = mkdtempSync(join(tmpdir(), 'pairs-'));
});

after(() => rmSync(folder, { recursive: true, force: true }));

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
    await drawn(page);
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

// Keys may have selected another pair meanwhile, and the focus stays where it was.
test('ADragMovesTheMarkerThatWasPressed', () =>
  withEditor(async (page) => {
    await addPairs(page, 2);
    await marker(page, 1, 'source').click();
    await page.keyboard.press('n');
    const before = await stored(page);
    const box = await marker(page, 1, 'source').boundingBox();
    await page.mouse.move(box.x + box.width / 2, box.y + box.height / 2);
    await page.mouse.down();
    await page.mouse.move(box.x + box.width / 2 + 30, box.y + box.height / 2 + 10, { steps: 5 });
    await page.mouse.up();
    const { pairs } = await stored(page);
    assert.notDeepEqual(pairs[0].source, before.pairs[0].source);
    assert.deepEqual(pairs[1], before.pairs[1]);
  }));

test('ADragThatTheBrowserEndsMovesNothing', () =>
  withEditor(async (page) => {
    await addPairs(page, 2);
    const before = await stored(page);
    const box = await marker(page, 1, 'source').boundingBox();
    await page.mouse.move(box.x + box.width / 2, box.y + box.height / 2);
    await page.mouse.down();
    await page.mouse.move(box.x + box.width / 2 + 30, box.y + box.height / 2 + 10, { steps: 5 });
    await marker(page, 1, 'source').dispatchEvent('pointercancel');
    await page.mouse.up();
    await marker(page, 2, 'source').click();
    assert.deepEqual(await stored(page), before);
  }));

test('MarkersKeepTheirSizeAndFade', () =>
  withEditor(async (page) => {
    await addPairs(page, 1);
    const mark = marker(page, 1, 'source');
    const before = await mark.locator('.body').boundingBox();
    await canvas(page, 'source').focus();
    for (let i = 0; i < 4; ++i) await page.keyboard.press('+');
    await drawn(page);
    const zoomed = await mark.locator('.body').boundingBox();
    assert.ok(Math.abs(zoomed.width - before.width) < 0.5);
    assert.notEqual(Math.round(zoomed.x), Math.round(before.x));
    await page.getByRole('button', { name: 'Go to pair 1' }).focus();
    await page.keyboard.press('Control+z');
    await page.keyboard.press('Control+Shift+z');
    await click(page, 'source', ...places[3]);
    await page.getByLabel('Time of the source').press('End');
    await drawn(page);
    assert.ok(Number(await mark.getAttribute('opacity')) < 0.5, 'far from the cursor in time');
    await page.getByLabel('Time of the source').press('Home');
    await drawn(page);
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
    await pane.locator('polyline.path').waitFor({ timeout: 20_000 * slowness });
    const points = (await pane.locator('polyline.path').getAttribute('points')).trim().split(' ');
    assert.ok(points.length >= 3, `${points}`);
    const start = await marker(page, 1, 'source').getAttribute('transform');
    for (let i = 0; i < 4; ++i) await page.keyboard.press('.');
    await drawn(page);
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
    assert.deepEqual(await numbers(page), [3, 4], 'those of the first file are not used again');
    await page.getByRole('button', { name: 'Go to pair 3' }).click();
    await page.getByRole('checkbox', { name: 'hard' }).check();
    const changed = await download(page, 'Export pairs');
    assert.match(changed, /^\{"correspondences": \[\n {2}\[\n {4}\{"kind":"point","hard":true,/);
    await upload(page, 'Import pairs', '{"correspondences": [[{"sauce": 1}]]}');
    await page.getByRole('alert').filter({ hasText: 'unknown key "sauce"' }).waitFor();
    assert.deepEqual(await numbers(page), [3, 4], 'a wrong file changes nothing');
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
