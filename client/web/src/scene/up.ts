// The world of the scene: y is up, whatever it is in the animation.
import { Box3, Matrix4, Vector3 } from 'three';
import { Up, type Bounds } from '../generated/liquidblend/v1/liquidblend_pb.ts';

// Where the animation's x, y and z point to in the scene.
const axes: Record<Up, [number[], number[], number[]]> = {
  [Up.UNSPECIFIED]: [
    [1, 0, 0],
    [0, 0, -1],
    [0, 1, 0],
  ],
  [Up.X]: [
    [0, 1, 0],
    [-1, 0, 0],
    [0, 0, 1],
  ],
  [Up.Y]: [
    [1, 0, 0],
    [0, 1, 0],
    [0, 0, 1],
  ],
  [Up.Z]: [
    [1, 0, 0],
    [0, 0, -1],
    [0, 1, 0],
  ],
  [Up.MINUS_X]: [
    [0, -1, 0],
    [1, 0, 0],
    [0, 0, 1],
  ],
  [Up.MINUS_Y]: [
    [1, 0, 0],
    [0, -1, 0],
    [0, 0, -1],
  ],
  [Up.MINUS_Z]: [
    [1, 0, 0],
    [0, 0, 1],
    [0, -1, 0],
  ],
};

function vector([x, y, z]: number[]): Vector3 {
  return new Vector3(x, y, z);
}

/** Rotates the animation's world into the scene's. */
export function sceneRotation(up: Up): Matrix4 {
  const [x, y, z] = axes[up] ?? axes[Up.Z];
  return new Matrix4().makeBasis(vector(x), vector(y), vector(z));
}

/** The box around all bounds, in the scene's world. */
export function sceneBox(bounds: readonly Bounds[], up: Up): Box3 {
  const box = new Box3();
  for (const { min, max } of bounds) {
    if (!min || !max) continue;
    box.expandByPoint(new Vector3(min.x, min.y, min.z));
    box.expandByPoint(new Vector3(max.x, max.y, max.z));
  }
  if (box.isEmpty()) box.set(new Vector3(-1, -1, -1), new Vector3(1, 1, 1));
  return box.applyMatrix4(sceneRotation(up));
}
