import assert from 'node:assert/strict';
import { before, test } from 'node:test';
import { api, ensurePadFamily, ensureSmoothFamily, ensureTetrahedron } from './library.mjs';
import { counters, drawn, newPage, openViewer, settled, waitFor } from './page.mjs';

let family;
before(async () => {
  family = await ensurePadFamily();
});

/** Does something on a page that shows the pad. */
async function withPad(act, options = {}, fields = {}) {
  const page = await newPage(options);
  try {
    await openViewer(page, { family, shade: 'plain', ...fields });
    await page.locator('lb-pad svg').waitFor();
    await act(page, page.locator('lb-pad svg'));
    assert.deepEqual(page.seen.errors, []);
  } finally {
    await page.context().close();
  }
}

/** The point and weights that the pad shows, of the source first. */
async function shown(page) {
  const values = await page
    .locator('lb-pad input[type=number]')
    .evaluateAll((inputs) => inputs.map((i) => Number(i.value)));
  const weights = await page.locator('lb-pad dl.weights dd').allTextContents();
  return { values, weights: weights.map(Number) };
}

async function serverWeights(parameters, extrapolate = false, of = family) {
  const query = new URLSearchParams({
    parameters,
    ...(extrapolate ? { extrapolate: 'true' } : {}),
  });
  const { response } = await api(`/v1/families/${of}/frame.drc?${query}`);
  assert.equal(response.status, 200);
  return response.headers.get('x-liquidblend-weights').split(',').map(Number);
}

async function drag(page, picture, points) {
  await picture.scrollIntoViewIfNeeded();
  const box = await picture.boundingBox();
  const at = ([x, y]) => [box.x + x * box.width, box.y + y * box.height];
  await page.mouse.move(...at(points[0]));
  await page.mouse.down();
  for (const point of points.slice(1)) await page.mouse.move(...at(point), { steps: 8 });
  await page.mouse.up();
  await drawn(page);
}

test('PadDrawsTheServersTriangles', () =>
  withPad(async (page, picture) => {
    const { json } = await api(`/v1/families/${family}`);
    const { simplices } = json.parameterSpace;
    assert.equal(simplices.length, 2);
    const places = await picture
      .locator('circle.point')
      .evaluateAll((all) =>
        all.map((one) => `${one.getAttribute('cx')},${one.getAttribute('cy')}`),
      );
    const areas = await picture
      .locator('polygon.area')
      .evaluateAll((all) => all.map((one) => one.getAttribute('points')));
    assert.deepEqual(
      areas,
      simplices.map(({ animations }) => animations.map((index) => places[index]).join(' ')),
    );
    assert.equal(await picture.locator('line.hull').count(), 4);
    assert.equal(await picture.locator('line.inner').count(), 1);
    const labels = await picture.locator('text.label').allTextContents();
    assert.deepEqual(
      labels,
      [0, 1, 2, 3].map((i) => `e2e_clip_${i}`),
    );
  }));

test('PadAsksForTheServersWeights', () =>
  withPad(async (page, picture) => {
    for (const end of [
      [0.4, 0.5],
      [0.55, 0.55],
      [0.6, 0.35],
    ]) {
      await drag(page, picture, [[0.45, 0.6], end]);
      await page.waitForURL(/[&?]p=/);
      const { state } = await page.evaluate(() => globalThis.liquidblend);
      const [width, place] = state.point;
      const expected = await serverWeights(`wall_width=${width},place=${place}`);
      await waitFor(
        page,
        ({ settled, lastShown: { weights } }) =>
          settled && weights.every((weight, i) => Math.abs(weight - expected[i]) < 1e-6),
      );
      state.weights.forEach((weight, i) =>
        assert.ok(Math.abs(weight - expected[i]) < 1e-6, `${state.weights}`),
      );
      const { values, weights } = await shown(page);
      assert.ok(Math.abs(values[0] - width) < 1e-6 && Math.abs(values[1] - place) < 1e-5);
      weights.slice(1).forEach((weight, i) => assert.ok(Math.abs(weight - expected[i]) < 1e-4));
    }
  }));

test('PadMovesTheFrameWhileItPlays', () =>
  withPad(
    async (page, picture) => {
      await waitFor(page, (pane) => pane.playing && pane.shown > 3);
      const before = await counters(page);
      await drag(page, picture, [
        [0.3, 0.6],
        [0.55, 0.5],
        [0.5, 0.35],
      ]);
      await page.waitForFunction(() => {
        const { state, panes } = globalThis.liquidblend;
        return panes[0].lastShown.weights.every(
          (weight, i) => Math.abs(weight - state.weights[i]) < 1e-5,
        );
      });
      const after = await counters(page);
      assert.equal(after.playing, true);
      assert.equal(after.orderViolations, 0);
      assert.ok(after.shown > before.shown);
    },
    {},
    { play: '1' },
  ));

test('PadMarksWhatIsOutsideAndExtrapolatesOnlyIfToldTo', () =>
  withPad(async (page, picture) => {
    await drag(page, picture, [
      [0.5, 0.5],
      [0.94, 0.55],
    ]);
    const note = page.locator('lb-pad p.note');
    await note.filter({ hasText: 'nearest point is shown' }).waitFor();
    assert.equal(await picture.locator('g.marker.outside').count(), 1);
    assert.equal(await picture.locator('circle.used').count(), 1, 'both places are marked');
    let pane = await settled(page);
    assert.equal(pane.lastShown.extrapolated, false);
    assert.ok(pane.lastShown.weights.every((weight) => weight >= 0));
    await page.getByRole('checkbox', { name: /Extrapolate/ }).check();
    await note.filter({ hasText: 'extrapolated' }).waitFor();
    await page.waitForURL(/beyond=1/);
    pane = await waitFor(page, ({ lastShown, settled }) => settled && lastShown.extrapolated);
    const { state } = await page.evaluate(() => globalThis.liquidblend);
    const expected = await serverWeights(
      `wall_width=${state.point[0]},place=${state.point[1]}`,
      true,
    );
    pane.lastShown.weights.forEach((weight, i) => assert.ok(Math.abs(weight - expected[i]) < 1e-6));
    const { weights } = await shown(page);
    weights.slice(1).forEach((weight, i) => assert.ok(Math.abs(weight - expected[i]) < 1e-4));
    assert.ok(Math.min(...weights) < 0);
  }));

test('PadIsDrivenByKeysAndNumbers', () =>
  withPad(async (page, picture) => {
    await page.getByRole('spinbutton', { name: 'wall_width' }).fill('0.8');
    await page.keyboard.press('Enter');
    await page.getByRole('spinbutton', { name: 'place' }).fill('35');
    await page.keyboard.press('Enter');
    await page.waitForURL(/p=0\.8,35/);
    const expected = await serverWeights('wall_width=0.8,place=35');
    const { lastShown } = await waitFor(
      page,
      ({ settled, lastShown: { weights } }) => settled && weights[0] > 0,
    );
    lastShown.weights.forEach((weight, i) => assert.ok(Math.abs(weight - expected[i]) < 1e-6));
    await picture.locator('g.marker').focus();
    await page.keyboard.press('ArrowRight');
    await page.waitForURL(/p=0\.807,35/);
    await page.keyboard.press('Shift+ArrowUp');
    await page.waitForURL(/p=0\.807,39/);
  }));

test('PadSnapsToAnimations', () =>
  withPad(async (page, picture) => {
    const box = await picture.locator('circle.point').nth(2).boundingBox();
    await page.mouse.click(box.x + box.width / 2 + 2, box.y + box.height / 2 + 2);
    await page.waitForURL(/p=0\.6,60/);
    const { lastShown } = await waitFor(
      page,
      ({ settled, lastShown: { weights } }) => settled && weights[1] > 0,
    );
    assert.deepEqual(lastShown.weights, [0, 1, 0]);
  }));

test('PadIsInTheUrl', () =>
  withPad(
    async (page, picture) => {
      assert.deepEqual((await shown(page)).values, [0.8, 35]);
      const slider = page.getByRole('slider', { name: /^Weight of/ }).first();
      const { lastShown } = await settled(page);
      const expected = await serverWeights('wall_width=0.8,place=35');
      assertClose(lastShown.weights, expected, 1e-6);
      assert.ok(Math.abs(Number(await slider.inputValue()) - expected[0]) < 0.01);
      await slider.press('ArrowRight');
      await page.waitForURL((url) => !/[&?]p=/.test(url.href));
    },
    {},
    { p: '0.8,35' },
  ));

function assertClose(weights, expected, tolerance) {
  assert.equal(weights.length, expected.length);
  weights.forEach((weight, i) =>
    assert.ok(Math.abs(weight - expected[i]) < tolerance, `${weights}, not ${expected}`),
  );
}

test('PadOfASmoothFamilyShowsTheServersWeights', async () => {
  const smooth = await ensureSmoothFamily();
  await withPad(
    async (page, picture) => {
      await drag(page, picture, [
        [0.45, 0.6],
        [0.5, 0.5],
      ]);
      await page.waitForURL(/[&?]p=/);
      const { point } = await page.evaluate(() => globalThis.liquidblend.state);
      const parameters = `wall_width=${point[0]},place=${point[1]}`;
      const expected = await serverWeights(parameters, false, smooth);
      const linear = await serverWeights(parameters);
      assert.ok(expected.some((weight, i) => Math.abs(weight - linear[i]) > 1e-3));
      const { lastShown } = await waitFor(
        page,
        ({ settled, lastShown: { weights } }) =>
          settled && Math.abs(weights[0] - expected[0]) < 1e-6,
      );
      assertClose(lastShown.weights, expected, 1e-6);
      const { weights } = await shown(page);
      assertClose(weights.slice(1), expected, 1e-4);
    },
    {},
    { family: smooth },
  );
});

test('PadOfThreeParametersChoosesItsAxes', async () => {
  const tetrahedron = await ensureTetrahedron();
  await withPad(
    async (page, picture) => {
      assert.equal(await picture.locator('line').count(), 6, 'all edges of the tetrahedron');
      await page.getByRole('slider', { name: 'height, slider' }).fill('2');
      await page.getByRole('spinbutton', { name: 'width' }).fill('0.7');
      await page.keyboard.press('Enter');
      await page.getByRole('spinbutton', { name: 'place' }).fill('30');
      await page.keyboard.press('Enter');
      await page.waitForURL(/p=0\.7,30,2/);
      const expected = await serverWeights('width=0.7,place=30,height=2', false, tetrahedron);
      const { lastShown } = await waitFor(
        page,
        ({ settled, lastShown: { weights } }) =>
          settled && Math.abs(weights[2] - expected[2]) < 1e-6,
      );
      assertClose(lastShown.weights, expected, 1e-6);
      await page.getByLabel('up').selectOption({ label: 'height' });
      await page.getByRole('slider', { name: 'place, slider' }).waitFor();
      await picture.locator('g.marker').focus();
      await page.keyboard.press('ArrowUp');
      await page.waitForURL(/p=0\.7,30,2\.02/);
    },
    {},
    { family: tetrahedron },
  );
});
