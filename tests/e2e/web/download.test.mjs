import assert from 'node:assert/strict';
import { execFileSync } from 'node:child_process';
import { mkdtempSync, readFileSync, rmSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import { test } from 'node:test';
import { newPage, openViewer, settled, slowness } from './page.mjs';

/** Downloads by the dialog, and gives the file's path and name to `check`. */
async function download(what, format, check) {
  const page = await newPage({ acceptDownloads: true });
  const folder = mkdtempSync(join(tmpdir(), 'download-'));
  try {
    await page.addInitScript(() => delete globalThis.showSaveFilePicker);
    await openViewer(page, { shade: 'plain', t: '0.5', w: '0.5' });
    await settled(page);
    await page.getByRole('button', { name: 'Download' }).click();
    const dialog = page.getByRole('dialog');
    await dialog.getByRole('radio', { name: what }).check();
    if (format) await dialog.getByRole('radio', { name: format }).check();
    const waiting = page.waitForEvent('download', { timeout: 120_000 * slowness });
    await dialog.getByRole('button', { name: 'Download' }).click();
    const file = await waiting;
    const path = join(folder, file.suggestedFilename());
    await file.saveAs(path);
    check(path, file.suggestedFilename(), folder);
  } finally {
    await page.context().close();
    rmSync(folder, { recursive: true });
  }
}

test('DownloadsAFrame', async () => {
  const begins = { PLY: 'ply\nformat binary', OBJ: '', Draco: 'DRACO' };
  for (const [format, begin] of Object.entries(begins)) {
    await download('This frame', new RegExp(`^${format}`), (path, name) => {
      assert.match(name, /^two_drops_0\.500s\.(ply|obj|drc)$/);
      const bytes = readFileSync(path);
      assert.ok(bytes.length > 10_000);
      assert.equal(bytes.toString('latin1', 0, begin.length), begin);
    });
  }
});

test('DownloadsAPicture', () =>
  download('A picture', undefined, (path, name) => {
    assert.match(name, /\.png$/);
    const bytes = readFileSync(path);
    assert.equal(bytes.toString('latin1', 1, 4), 'PNG');
    assert.ok(bytes.length > 10_000, 'it is not empty');
  }));

test('DownloadsAnAnimation', () =>
  download('The whole animation', /^Draco/, (path, name, folder) => {
    assert.match(name, /_drc\.tar$/);
    execFileSync('tar', ['-xf', path], { cwd: folder });
    const names = execFileSync('tar', ['-tf', path], { encoding: 'utf8' }).trim().split('\n');
    assert.equal(names.length, 73);
    assert.equal(readFileSync(join(folder, 'frame_0072.drc')).toString('latin1', 0, 5), 'DRACO');
    const meta = JSON.parse(readFileSync(join(folder, 'meta.json'), 'utf8'));
    assert.equal(meta.fps, 24);
    assert.deepEqual(meta.about.weights, [0.5]);
  }));

test('CancelsTheDownloadOfAnAnimation', async () => {
  const page = await newPage();
  try {
    await page.addInitScript(() => delete globalThis.showSaveFilePicker);
    await openViewer(page, { shade: 'plain' });
    let sent = 0;
    await page.route(/frame\.ply/, async (route) => {
      ++sent;
      await new Promise((resolve) => setTimeout(resolve, 100));
      await route.continue().catch(() => {});
    });
    await page.getByRole('button', { name: 'Download' }).click();
    const dialog = page.getByRole('dialog');
    await dialog.getByRole('radio', { name: 'The whole animation' }).check();
    await dialog.getByRole('button', { name: 'Download' }).click();
    await dialog.getByRole('progressbar').waitFor();
    await dialog.getByRole('button', { name: 'Cancel' }).click();
    await dialog.getByRole('button', { name: 'Close' }).waitFor();
    for (let before = -1; before < sent; ) {  // the last request may be told of later
      before = sent;
      await page.waitForTimeout(1000);
    }
    assert.ok(sent < 72);
  } finally {
    await page.context().close();
  }
});
