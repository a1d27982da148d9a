import assert from 'node:assert/strict';
import { test } from 'node:test';
import { Camera, type Rotation } from '../src/editor/camera.ts';
import { colourOf } from '../src/editor/colours.ts';
import { opacityAt } from '../src/editor/marks.ts';
import { nearestVertex, placeAt } from '../src/editor/path.ts';
import { castRay, firstHit, hitNearest } from '../src/editor/picker.ts';
import { timeDistance } from '../src/pairs/pairs.ts';
import { place } from './places.ts';

// z is up in the animation, y in the scene.
const zUp: Rotation = [
  [1, 0, 0],
  [0, 0, -1],
  [0, 1, 0],
];
const orbit = {
  azimuth: 30,
  elevation: 20,
  distance: 5,
  target: [0.2, 0.1, -0.3] as [number, number, number],
};

test('ARayGoesThroughWhatIsSeenThere', () => {
  const camera = new Camera(orbit, zUp, 640, 400);
  const point: [number, number, number] = [0.4, -0.7, 0.3];
  const seen = camera.see(point);
  const { origin, direction } = camera.rayThrough(seen);
  const way = point.map((value, i) => value - origin[i]!);
  const length = Math.hypot(...way);
  way.forEach((value, i) => assert.ok(Math.abs(value / length - direction[i]!) < 1e-9));
  const middle = camera.see([0.2, 0.3, 0.1]);
  assert.ok(
    Math.abs(middle.x - 320) < 1e-6 && Math.abs(middle.y - 200) < 1e-6,
    'the orbit turns around it',
  );
});

// The sides of a box from 0 to 1.
const box = {
  positions: [0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 1, 0, 0, 0, 1, 1, 0, 1, 1, 1, 1, 0, 1, 1],
  indices: [
    0, 2, 1, 0, 3, 2, 4, 5, 6, 4, 6, 7, 0, 1, 5, 0, 5, 4, 2, 3, 7, 2, 7, 6, 1, 2, 6, 1, 6, 5, 3, 0,
    4, 3, 4, 7,
  ],
  count: 36,
};

test('RaysMeetTheSurface', () => {
  const ray = {
    origin: [0.3, 0.4, 5] as [number, number, number],
    direction: [0, 0, -1] as [number, number, number],
  };
  assert.deepEqual(castRay(ray, box).sort(), [4, 5]);
  assert.deepEqual(firstHit(ray, box), [0.3, 0.4, 1]);
  assert.deepEqual(hitNearest(ray, box, [0.3, 0.4, 0.1]), [0.3, 0.4, 0]);
  assert.equal(firstHit({ ...ray, direction: [0, 0, 1] }, box), undefined);
  assert.equal(firstHit({ ...ray, origin: [3, 0.4, 5] }, box), undefined);
});

test('OnlyTheUsedPartOfArraysIsMet', () => {
  const ray = {
    origin: [0.3, 0.4, 5] as [number, number, number],
    direction: [0, 0, -1] as [number, number, number],
  };
  assert.deepEqual(castRay(ray, { ...box, count: 6 }), [5]);
});

test('MarkersFadeWithTheDistanceInTime', () => {
  assert.equal(opacityAt(0), 1);
  assert.ok(opacityAt(0.1) < 1 && opacityAt(0.1) > opacityAt(0.3));
  assert.equal(opacityAt(9), opacityAt(99));
  const pair = {
    number: 1,
    kind: 'TRAJECTORY' as const,
    hard: false,
    lengthS: 0.5,
    enabled: true,
    check: false,
  };
  assert.equal(timeDistance(pair, place(0, 1), 1.4), 0);
  assert.equal(timeDistance(pair, place(0, 1), 2), 0.5);
  assert.equal(timeDistance({ ...pair, lengthS: 0 }, place(0, 1), 9), 0);
  assert.equal(timeDistance({ ...pair, kind: 'POINT' }, place(0, 1), 1.5), 0.5);
});

test('APathIsFollowedInTime', () => {
  const path = [place(0, 1), place(1, 2), place(3, 3)];
  assert.equal(placeAt(path, place(0, 1), 0)[0], 0);
  assert.equal(placeAt(path, place(0, 1), 2.5)[0], 2);
  assert.equal(placeAt(path, place(0, 1), 9)[0], 3);
  assert.equal(placeAt([], place(7, 1), 2)[0], 7);
  assert.equal(nearestVertex(box.positions, 8, [0.9, 0.1, 0.8]), 5);
});

test('ColoursOfNeighboursDiffer', () => {
  for (let number = 1; number < 40; ++number)
    assert.notEqual(colourOf(number), colourOf(number + 1));
});
