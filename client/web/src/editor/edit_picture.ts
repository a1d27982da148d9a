// The picture of one animation as it was imported, and what a pixel of it is in the animation.
import type { ApiError } from '../api/errors.ts';
import { theme } from '../base/theme.ts';
import type { Vector } from '../pairs/pairs.ts';
import type { Orbit } from '../scene/orbit.ts';
import { OrbitInput } from '../scene/orbit_input.ts';
import { sharedPool } from '../stream/decoder_pool.ts';
import type { PlayerSettings } from '../stream/player.ts';
import { Picture } from '../view/picture.ts';
import type { SubjectInfo } from '../view/subject.ts';
import { Camera, type Pixel, type Rotation } from './camera.ts';
import { atDepthOf, firstHit, hitNearest, type Triangles } from './picker.ts';

export interface EditPictureEvents {
  /** Another frame or size: markers are drawn anew. */
  changed(): void;
  error(error: ApiError | undefined): void;
  /** The person moved the camera. */
  orbit(orbit: Orbit): void;
}

const still: PlayerSettings = {
  blend: { weights: [] },
  rate: 1,
  loop: 'off',
  range: [0, 0],
  framesPerSecond: 0,
  level: 0,
  wanted: { normals: true, velocities: false, restPositions: false, edges: false },
};

/** Errors: the constructor throws where WebGL 2 is missing. */
export class EditPicture {
  private readonly picture: Picture;
  private readonly resizes: ResizeObserver;
  private info: SubjectInfo | undefined;
  private timeS = -1;

  constructor(
    private readonly canvas: HTMLCanvasElement,
    events: EditPictureEvents,
  ) {
    const picture = new Picture(canvas, sharedPool(), {
      shown: () => events.changed(),
      changed: () => {},
      error: (error) => events.error(error),
    });
    this.picture = picture;
    this.applyTheme();
    this.resizes = new ResizeObserver(() => {
      picture.setSize(canvas.clientWidth, canvas.clientHeight);
      events.changed();
    });
    this.resizes.observe(canvas);
    new OrbitInput(canvas, {
      get orbit() {
        return picture.orbit;
      },
      get radius() {
        return picture.stage.sphere.radius;
      },
      move: (orbit) => events.orbit(orbit),
      reset: () => {},  // two clicks mark two places
    });
  }

  get size(): { width: number; height: number } {
    return { width: this.canvas.clientWidth || 1, height: this.canvas.clientHeight || 1 };
  }

  /** Shows a time of an animation. */
  show(info: SubjectInfo, timeS: number): void {
    if (info !== this.info) {
      this.picture.open(info, still);
      this.info = info;
      this.timeS = -1;
    }
    if (timeS === this.timeS) return;
    this.timeS = timeS;
    this.picture.player?.seek(timeS, true);
  }

  /** undefined: all in view. */
  setOrbit(orbit: Orbit | undefined): void {
    this.picture.setOrbit(orbit);
  }

  applyTheme(): void {
    this.picture.setLook({ shading: 'plain', wireframe: false, pattern: false, theme: theme.value });
  }

  close(): void {
    this.resizes.disconnect();
    this.picture.close();
  }

  /** undefined before an animation is shown. */
  camera(): Camera | undefined {
    if (!this.info) return undefined;
    const e = this.info.rotation.elements;
    const rotation: Rotation = [
      [e[0]!, e[1]!, e[2]!],
      [e[4]!, e[5]!, e[6]!],
      [e[8]!, e[9]!, e[10]!],
    ];
    const { width, height } = this.size;
    return new Camera(this.picture.orbit, rotation, width, height);
  }

  /** Whether the frame of the time is there, so that it can be marked. */
  get ready(): boolean {
    return !!this.surface();
  }

  /** The place of the surface at a pixel: the first one, or the one nearest to another place. */
  placeAt(pixel: Pixel, near?: Vector): Vector | undefined {
    const surface = this.surface();
    const ray = this.camera()?.rayThrough(pixel);
    if (!surface || !ray) return undefined;
    return near ? hitNearest(ray, surface, near) : firstHit(ray, surface);
  }

  /** The place at a pixel that is as far away as another one, surface or not. */
  beside(pixel: Pixel, place: Vector): Vector | undefined {
    const ray = this.camera()?.rayThrough(pixel);
    return ray && atDepthOf(ray, place);
  }

  private surface(): Triangles | undefined {
    const { shown, stage } = this.picture;
    const frameS = 1 / (this.info?.timing.framesPerSecond ?? 24);
    if (!shown || Math.abs(shown.info.timeS - this.timeS) > frameS / 2) return undefined;
    const { triangles } = stage.surface;
    const position = triangles.getAttribute('position');
    if (!position || !triangles.index) return undefined;
    return {
      positions: position.array,
      indices: triangles.index.array,
      count: 3 * shown.counts.triangles,
    };
  }
}
