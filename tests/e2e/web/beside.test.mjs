import assert from 'node:assert/strict';
import { test } from 'node:test';
import { baseUrl, family, newPage, openViewer, panes, token, waitForPanes } from './page.mjs';

const headers = token ? { Authorization: `Bearer ${token}` } : {};
const { source } = await (await fetch(`${baseUrl}/v1/families/${family}`, { headers })).json();
const frame = await fetch(`${baseUrl}/v1/${source}/frame.drc?frameNumber=1`, { headers });
const skip = frame.status === 404 ? 'the server has no frames of animations' : false;

const shown = (list) => list.length === 3 && list.every((pane) => pane.shown && pane.settled);

/** The viewer with source and target beside the blend. */
async function withThree(fields, check) {
  const page = await newPage();
  try {
    await openViewer(page, { shade: 'plain', w: '0.5', ...fields });
    await page.getByRole('button', { name: 'Side by side' }).click();
    await page.getByRole('checkbox', { name: /^Source/ }).check();
    await page
      .getByRole('checkbox', { name: /^Target/ })
      .first()
      .check();
    await waitForPanes(page, shown);
    await check(page);
  } finally {
    await page.context().close();
  }
}

test('ShowsInputsBesideTheBlend', { skip }, () =>
  withThree({ t: '0.5' }, async (page) => {
    const [blend, first, second] = await panes(page);
    assert.deepEqual(
      [blend, first, second].map((pane) => pane.error),
      ['', '', ''],
    );
    assert.equal(first.lastShown.frameNumber, 13);
    assert.ok(Math.abs(second.lastShown.timeS - 0.5) < 1e-6);
    await page.keyboard.press('Escape');
    await page.waitForURL(/beside=source,target/);
    const before = await page.locator('.panes').screenshot();
    await page.reload();
    await waitForPanes(page, shown);
    assert.ok(
      before.equals(await page.locator('.panes').screenshot()),
      'the pictures differ after a reload',
    );
  }),
);

test('CouplesTimesAndCamerasUnlessToldNotTo', { skip }, () =>
  withThree({ t: '0.5' }, async (page) => {
    const time = page.getByRole('slider', { name: /^Time of/ });
    await page.keyboard.press('Escape');
    await time.first().focus();
    await time.first().press('PageUp');
    await waitForPanes(page, (list) =>
      list.every((pane) => Math.abs(pane.lastShown.timeS - 22 / 24) < 0.01),
    );
    await page.getByRole('button', { name: 'Side by side' }).click();
    await page.getByRole('checkbox', { name: 'Times' }).uncheck();
    await page.getByRole('checkbox', { name: 'Cameras' }).uncheck();
    await page.keyboard.press('Escape');
    assert.equal(await time.count(), 3);
    await time.nth(1).focus();
    await time.nth(1).press('Home');
    await page.locator('canvas').nth(2).focus();
    await page.keyboard.press('ArrowLeft');
    await waitForPanes(
      page,
      (list) => list.some((pane) => pane.lastShown.timeS === 0) && shown(list),
    );
    const times = (await panes(page)).map((pane) => pane.timeS).sort();
    assert.ok(times[0] === 0 && times[1] > 0.9 && times[2] > 0.9, `${times}`);
    await page.waitForURL(/cameras=own&times=own/);
    await page.waitForURL(/cam3=/);
  }),
);

test('InputsFollowTheBlendWhileItPlays', { skip }, () =>
  withThree({}, async (page) => {
    await page.keyboard.press('Escape');
    await page.getByRole('button', { name: 'Play' }).first().click();
    await waitForPanes(
      page,
      ([blend, first, second]) =>
        blend.timeS > 1 && first.lastShown.timeS > 0.8 && second.lastShown.timeS > 0.8,
    );
    const now = await panes(page);
    for (const pane of now) assert.equal(pane.orderViolations, 0);
  }),
);

test('PlaysAnAnimationByItself', { skip }, async () => {
  const page = await newPage();
  try {
    await page.goto(`${baseUrl}/#view?animation=${source.split('/')[1]}&play=1&shade=plain`);
    await waitForPanes(page, ([pane]) => pane?.playing && pane.lastShown?.frameNumber > 10);
    await page.getByRole('button', { name: 'Pause' }).click();
    const [pane] = await waitForPanes(page, ([now]) => !now.playing && now.settled);
    assert.equal(pane.connection, 'closed');
    assert.ok(Math.abs(pane.lastShown.timeS * 24 + 1 - pane.lastShown.frameNumber) < 0.01);
  } finally {
    await page.context().close();
  }
});
