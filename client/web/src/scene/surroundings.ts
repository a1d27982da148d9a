// The edges of the box around an animation, and a grid on its ground.
import {
  Box3,
  BufferAttribute,
  BufferGeometry,
  Group,
  LineBasicMaterial,
  LineSegments,
  Vector3,
} from 'three';
import { gridStepOf, palettes, type SceneTheme } from './studio.ts';

const corners = [0, 1, 1, 3, 3, 2, 2, 0, 4, 5, 5, 7, 7, 6, 6, 4, 0, 4, 1, 5, 2, 6, 3, 7];

export class Surroundings {
  readonly group = new Group();
  private readonly box = new LineSegments(
    new BufferGeometry(),
    new LineBasicMaterial({ transparent: true, opacity: 0.6 }),
  );
  private readonly grid = new LineSegments(
    new BufferGeometry(),
    new LineBasicMaterial({ transparent: true, opacity: 0.8 }),
  );

  constructor() {
    this.group.add(this.box, this.grid);
  }

  /** The liquid shading draws its own ground. */
  showGrid(shown: boolean): void {
    this.grid.visible = shown;
  }

  setTheme(theme: SceneTheme): void {
    this.box.material.color.set(palettes[theme].box);
    this.grid.material.color.set(palettes[theme].line);
  }

  setBox(bounds: Box3): void {
    replacePoints(this.box.geometry, boxPoints(bounds));
    replacePoints(this.grid.geometry, gridPoints(bounds));
  }

  dispose(): void {
    for (const lines of [this.box, this.grid]) {
      lines.geometry.dispose();
      lines.material.dispose();
    }
  }
}

function replacePoints(geometry: BufferGeometry, points: number[]): void {
  geometry.dispose();
  geometry.setAttribute('position', new BufferAttribute(new Float32Array(points), 3));
  geometry.computeBoundingSphere();
}

function boxPoints({ min, max }: Box3): number[] {
  return corners.flatMap((corner) => [
    corner & 1 ? max.x : min.x,
    corner & 2 ? max.y : min.y,
    corner & 4 ? max.z : min.z,
  ]);
}

function gridPoints(bounds: Box3): number[] {
  const size = bounds.getSize(new Vector3());
  const center = bounds.getCenter(new Vector3());
  const step = gridStepOf(Math.max(size.x, size.z));
  const y = bounds.min.y;
  const half = Math.ceil((0.75 * Math.max(size.x, size.z)) / step);
  const points: number[] = [];
  for (let i = -half; i <= half; ++i) {
    const at = i * step;
    const end = half * step;
    points.push(center.x + at, y, center.z - end, center.x + at, y, center.z + end);
    points.push(center.x - end, y, center.z + at, center.x + end, y, center.z + at);
  }
  return points;
}
