import assert from 'node:assert/strict';
import { test } from 'node:test';
import { isLine, placeOf, scaledAt } from '../src/pad/pad_frame.ts';
import { closestIn, coordinatesIn, edgesOf, PointSpace, solve } from '../src/pad/space.ts';

// Four animations: the source, then three targets.
const points = [
  [0.5, 20],
  [1, 20],
  [0.6, 60],
  [1.2, 55],
];
const space = new PointSpace(['width', 'place'], points, [
  [0, 1, 2],
  [1, 2, 3],
]);

function near(actual: readonly number[], expected: readonly number[], within = 1e-9): void {
  assert.equal(actual.length, expected.length);
  actual.forEach((value, i) => assert.ok(Math.abs(value - expected[i]!) <= within, `${actual}`));
}

test('SystemsAreSolved', () => {
  near(
    solve(
      [
        [0, 2],
        [3, 1],
      ],
      [4, 5],
    )!,
    [1, 2],
  );
  assert.equal(
    solve(
      [
        [1, 2],
        [2, 4],
      ],
      [1, 2],
    ),
    undefined,
  );
});

test('CoordinatesAddUpToOneAndGiveThePointBack', () => {
  const corners = [
    [0, 0, 0],
    [1, 0.1, 0],
    [0.2, 1, 0],
    [0.3, 0.2, 1],
  ];
  const coordinates = coordinatesIn(corners, [0.4, 0.3, 0.2]);
  near([coordinates.reduce((a, b) => a + b)], [1]);
  near(
    [0, 1, 2].map((i) => coordinates.reduce((sum, c, k) => sum + c * corners[k]![i]!, 0)),
    [0.4, 0.3, 0.2],
  );
});

test('AnAnimationsOwnPointIsThatAnimation', () => {
  points.forEach((point, index) => {
    const { weights, isOutside } = space.locate(point)!;
    assert.deepEqual(
      weights,
      [1, 2, 3].map((k) => (k === index ? 1 : 0)),
    );
    assert.equal(isOutside, false);
  });
});

test('WeightsGiveThePointBack', () => {
  const point = [0.8, 40];
  const { weights } = space.locate(point)!;
  const all = [1 - weights.reduce((a, b) => a + b), ...weights];
  near(
    [0, 1].map((i) => all.reduce((sum, w, k) => sum + w * points[k]![i]!, 0)),
    point,
    1e-7,
  );
  assert.ok(all.every((weight) => weight >= -1e-9));
  assert.ok(
    weights.every((weight) => Number.isInteger(weight * 2 ** 30)),
    'multiples of 2^-30',
  );
});

test('OutsideOfTheHullTheNearestPointIsKnown', () => {
  const location = space.locate([0.2, 10])!;
  assert.equal(location.isOutside, true);
  near(location.nearest, points[0]!);
  assert.deepEqual(location.nearestWeights, [0, 0, 0]);
  const below = space.locate([0.75, 10])!;
  near(below.nearest, [0.75, 20]);
  near(below.nearestWeights, [0.5, 0, 0], 1e-8);
  near([below.distance], [0.25]);
  assert.ok(
    Math.min(...below.weights, 1 - below.weights.reduce((a, b) => a + b)) < 0,
    'not clamped',
  );
});

test('APointOnTheHullIsInside', () => {
  assert.equal(space.locate([0.75, 20])!.isOutside, false);
  assert.equal(space.locate([0.75, 20 - 1e-9])!.isOutside, false);
});

test('OneParameterIsIntervals', () => {
  const line = new PointSpace(
    ['height'],
    [[1], [4], [2]],
    [
      [0, 2],
      [1, 2],
    ],
  );
  assert.deepEqual(line.locate([3])!.weights, [0.5, 0.5]);
  assert.deepEqual(line.locate([5])!.nearest, [4]);
  assert.deepEqual(line.locate([5])!.weights, [1.5, -0.5]);
});

test('WithoutSimplicesNothingIsLocated', () => {
  assert.equal(new PointSpace(['a'], [[1], [2]], []).locate([1.5]), undefined);
});

test('TheClosestPointOfATetrahedronIsOnASide', () => {
  const corners = [
    [0, 0, 0],
    [1, 0, 0],
    [0, 1, 0],
    [0, 0, 1],
  ];
  near(closestIn(corners, [0.2, 0.2, -3]), [0.2, 0.2, 0]);
  near(closestIn(corners, [1, 1, 1]), [1 / 3, 1 / 3, 1 / 3]);
  near(closestIn(corners, [0.1, 0.1, 0.1]), [0.1, 0.1, 0.1]);
});

test('TheHullHasTheEdgesOfOneTriangle', () => {
  const { hull, inner } = edgesOf(space.simplices);
  assert.deepEqual(inner, [[1, 2]]);
  assert.equal(hull.length, 4);
});

test('PlacesInThePictureAndPointsAreInverse', () => {
  const scaled = [0.3, 0.6, 0.9];
  near(scaledAt(placeOf(scaled, [2, 0]), [2, 0], scaled), scaled);
  assert.equal(isLine([1, 1]), true);
  near(scaledAt(placeOf([0.3], [0, 0]), [0, 0], [0]), [0.3]);
});
