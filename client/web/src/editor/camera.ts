// Between the picture and the animation's world.
import type { Vector } from '../pairs/pairs.ts';
import { backward, eyeOf, fieldOfView, type Orbit } from '../scene/orbit.ts';

/** A place in the picture, in CSS pixels from its upper left corner. */
export interface Pixel {
  x: number;
  y: number;
}

export interface Ray {
  origin: Vector;
  direction: Vector;
}

/** Where a point is seen. */
export interface Seen extends Pixel {
  depth: number;  // in front of the camera if above 0
}

/** Rotates the animation's world into the scene's: the columns of a matrix. */
export type Rotation = readonly [Vector, Vector, Vector];

const tangent = Math.tan((fieldOfView / 2) * (Math.PI / 180));

export function dot(a: Vector, b: Vector): number {
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

export function plus(a: Vector, b: Vector, factor = 1): Vector {
  return [a[0] + factor * b[0], a[1] + factor * b[1], a[2] + factor * b[2]];
}

function cross(a: Vector, b: Vector): Vector {
  return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
}

function unit(a: Vector): Vector {
  const length = Math.hypot(...a) || 1;
  return [a[0] / length, a[1] / length, a[2] / length];
}

/** Looks from an orbit into a picture of a size. */
export class Camera {
  private readonly eye: Vector;
  private readonly back: Vector;
  private readonly right: Vector;
  private readonly up: Vector;

  constructor(
    orbit: Orbit,
    private readonly rotation: Rotation,
    private readonly width: number,
    private readonly height: number,
  ) {
    this.eye = eyeOf(orbit);
    this.back = backward(orbit);
    this.right = unit(cross([0, 1, 0], this.back));
    this.up = cross(this.back, this.right);
  }

  /** The ray, in the animation's world, through a place of the picture. */
  rayThrough({ x, y }: Pixel): Ray {
    const right = ((2 * x - this.width) / this.height) * tangent;
    const up = (1 - (2 * y) / this.height) * tangent;
    const direction = unit(
      plus(plus(plus([0, 0, 0], this.back, -1), this.right, right), this.up, up),
    );
    return { origin: this.toWorld(this.eye), direction: this.toWorld(direction) };
  }

  /** Where a point of the animation's world is seen. */
  see(point: Vector): Seen {
    const offset = plus(this.toScene(point), this.eye, -1);
    const depth = -dot(offset, this.back);
    const scale = this.height / (2 * tangent * Math.max(depth, 1e-9));
    return {
      x: this.width / 2 + dot(offset, this.right) * scale,
      y: this.height / 2 - dot(offset, this.up) * scale,
      depth,
    };
  }

  private toScene([x, y, z]: Vector): Vector {
    const [a, b, c] = this.rotation;
    return plus(plus(plus([0, 0, 0], a, x), b, y), c, z);
  }

  private toWorld(vector: Vector): Vector {
    const [a, b, c] = this.rotation;
    return [dot(a, vector), dot(b, vector), dot(c, vector)];
  }
}
