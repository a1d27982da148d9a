import assert from 'node:assert/strict';
import { test } from 'node:test';
import { Vector3 } from 'three';
import { Up } from '../src/generated/liquidblend/v1/liquidblend_pb.ts';
import { gridStepOf } from '../src/scene/studio.ts';
import { sceneBox, sceneRotation } from '../src/scene/up.ts';
import { Surface } from '../src/scene/surface.ts';

const ups: [Up, [number, number, number]][] = [
  [Up.UNSPECIFIED, [0, 0, 1]],
  [Up.X, [1, 0, 0]],
  [Up.Y, [0, 1, 0]],
  [Up.Z, [0, 0, 1]],
  [Up.MINUS_X, [-1, 0, 0]],
  [Up.MINUS_Y, [0, -1, 0]],
  [Up.MINUS_Z, [0, 0, -1]],
];

test('UpIsUpInTheSceneAndNothingIsMirrored', () => {
  for (const [up, direction] of ups) {
    const rotation = sceneRotation(up);
    const turned = new Vector3(...direction).applyMatrix4(rotation);
    assert.ok(turned.distanceTo(new Vector3(0, 1, 0)) < 1e-9, Up[up]);
    assert.ok(Math.abs(rotation.determinant() - 1) < 1e-9, Up[up]);
  }
});

test('BoxesSurroundAllBounds', () => {
  const point = (x: number, y: number, z: number) => ({ $typeName: 'liquidblend.v1.Vector3' as const, x, y, z });
  const bounds = (min: number, max: number) => ({
    $typeName: 'liquidblend.v1.Bounds' as const,
    min: point(min, min, min),
    max: point(max, max, max),
  });
  const box = sceneBox([bounds(-1, 0), bounds(0, 2)], Up.Z);
  assert.deepEqual(box.min.toArray(), [-1, -1, -2]);
  assert.deepEqual(box.max.toArray(), [2, 2, 1]);
  assert.equal(sceneBox([], Up.Z).isEmpty(), false);
});

test('GridStepsAreRound', () => {
  assert.deepEqual([8, 4.31, 0.05, 900].map(gridStepOf), [1, 0.5, 0.005, 100]);
});

test('SurfacesKeepTheirAttributesUntilTheyMustGrow', () => {
  const surface = new Surface();
  const frame = (vertices: number) => ({
    buffers: {
      positions: new Float32Array(3 * vertices).fill(vertices),
      normals: new Float32Array(3 * vertices),
      velocities: new Float32Array(0),
      restPositions: new Float32Array(4 * vertices).fill(vertices),
      triangles: new Uint32Array(6 * vertices),
      edges: new Uint32Array(0),
    },
    counts: {
      vertices,
      triangles: 2 * vertices,
      edges: 0,
      hasNormals: true,
      hasVelocities: false,
      hasRestPositions: true,
    },
  });
  const show = (vertices: number) => {
    const { buffers, counts } = frame(vertices);
    surface.update(buffers, counts);
    return surface.triangles.getAttribute('position');
  };
  const first = show(1000);
  for (const vertices of [1100, 10, 1200]) assert.equal(show(vertices), first);
  assert.equal(surface.triangles.drawRange.count, 3 * 2 * 1200);
  assert.equal(surface.numGrown, 1);
  const rest = surface.triangles.getAttribute('rest');
  assert.deepEqual([rest.itemSize, rest.array[4 * 1200 - 1]], [4, 1200]);
  assert.notEqual(show(2000), first);
  assert.equal(surface.numGrown, 2);
});
