import assert from 'node:assert/strict';
import { execFileSync } from 'node:child_process';
import { mkdtempSync, readFileSync, rmSync, writeFileSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import { test } from 'node:test';
import { formatBytes, formatCount } from '../src/base/format.ts';
import { Meter, Rate } from '../src/base/meter.ts';
import { roundTo } from '../src/base/numbers.ts';
import { tarEnd, tarHeader, tarPadding, tarSize } from '../src/base/tar.ts';
import { eyeOf, fitted, panned, rounded, turned, zoomed } from '../src/scene/orbit.ts';
import { Effort } from '../src/view/effort.ts';

test('TarIsReadByTar', () => {
  const files: [string, string][] = [['frame_0001.ply', 'x'.repeat(700)], ['meta.json', '{}']];
  const parts = files.flatMap(([name, text]) => [
    tarHeader(name, text.length),
    new TextEncoder().encode(text),
    tarPadding(text.length),
  ]);
  const archive = Buffer.concat([...parts, tarEnd()]);
  assert.equal(archive.length, tarSize(files.map(([, text]) => text.length)));
  const folder = mkdtempSync(join(tmpdir(), 'tar-'));
  try {
    writeFileSync(join(folder, 'a.tar'), archive);
    execFileSync('tar', ['-xf', 'a.tar'], { cwd: folder });
    for (const [name, text] of files) assert.equal(readFileSync(join(folder, name), 'utf8'), text);
  } finally {
    rmSync(folder, { recursive: true });
  }
});

test('NumbersAreReadable', () => {
  assert.deepEqual([0, 999, 1000, 26521, 1.5e6, 2.5e9].map(formatBytes), [
    '0 B',
    '999 B',
    '1.0 kB',
    '26.5 kB',
    '1.5 MB',
    '2.5 GB',
  ]);
  assert.deepEqual([8371, 50_123, 2.5e6].map(formatCount), ['8371', '50.1k', '2.5M']);
  assert.equal(Object.is(roundTo(-0.00001, 2), 0), true);
});

test('MetersForgetTheOldest', () => {
  const meter = new Meter(4);
  for (const value of [100, 1, 2, 3, 4]) meter.add(value);
  assert.equal(meter.mean, 2.5);
  assert.equal(meter.percentile(1), 4);
  const rate = new Rate(1000);
  for (let ms = 0; ms < 2000; ms += 50) rate.add(ms);
  assert.equal(rate.perSecond(1950), 21);
});

test('CamerasAreRoundedAfterEachMove', () => {
  const start = fitted({ center: [0, 0, 0], radius: 2 }, 1.5);
  const moved = panned(zoomed(turned(start, 33.3333, 7.7777), 0.9, 2), 0.123, -0.321);
  assert.deepEqual(rounded(moved), moved);
  assert.deepEqual(rounded(JSON.parse(JSON.stringify(moved))), moved);
});

test('CamerasKeepTheirDistance', () => {
  const orbit = { azimuth: 90, elevation: 0, distance: 5, target: [1, 2, 3] as [number, number, number] };
  const eye = eyeOf(orbit);
  assert.ok(Math.abs(eye[0] - 6) < 1e-9 && Math.abs(eye[1] - 2) < 1e-9 && Math.abs(eye[2] - 3) < 1e-9);
  assert.equal(turned(orbit, 0, 200).elevation, 89);
});

test('DrawingGetsCoarserWhileItIsSlowAndFinerAgain', () => {
  const effort = new Effort();
  const run = (frames: number, ms: number) => {
    for (let i = 0; i < frames; ++i) effort.measure(ms);
  };
  run(100, 60);
  assert.equal(effort.level, 2);
  assert.equal(effort.ratio(true), 1, 'still pictures stay fine');
  run(1000, 16);
  assert.equal(effort.level, 0);
  assert.equal(effort.ratio(false), 1);
});
