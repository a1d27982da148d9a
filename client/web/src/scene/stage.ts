// Draws one animation into one canvas.
import {
  Box3,
  BufferAttribute,
  BufferGeometry,
  Color,
  ColorManagement,
  HalfFloatType,
  LineSegments,
  LinearSRGBColorSpace,
  Matrix4,
  Mesh,
  PerspectiveCamera,
  RedFormat,
  Scene,
  Sphere,
  WebGLRenderer,
  WebGLRenderTarget,
} from 'three';
import type { DecodedFrame } from '../stream/frame.ts';
import { liquidMaterials } from './liquid.ts';
import { eyeOf, fieldOfView, type Orbit, type Sphere as OrbitSphere } from './orbit.ts';
import { plainMaterials, setPlainTheme } from './plain.ts';
import { isSoftware } from './software.ts';
import { palettes, setBox, setTheme, studioUniforms, type SceneTheme } from './studio.ts';
import { Surface } from './surface.ts';
import { Surroundings } from './surroundings.ts';

export type Shading = 'liquid' | 'plain';

export interface Look {
  shading: Shading;
  wireframe: boolean;
  pattern: boolean; // where frames have rest positions
  theme: SceneTheme;
}

const patternShare = 0.5;

// Colours are what the screen gets; shaders that add light convert them themselves.
ColorManagement.enabled = false;

/** Errors: the constructor throws where WebGL 2 is missing. */
export class Stage {
  readonly renderer: WebGLRenderer;
  readonly software = isSoftware();
  readonly surface = new Surface();
  private readonly scene = new Scene();
  private readonly hidden = new Scene(); // what is drawn into the thickness only
  private readonly background = new Scene();
  private readonly copies = new Scene();
  private readonly camera = new PerspectiveCamera(fieldOfView, 1);
  private readonly studio = studioUniforms();
  private readonly liquid = liquidMaterials(this.studio);
  private readonly plain = plainMaterials(this.studio);
  private readonly surroundings = new Surroundings();
  private readonly thickness = new WebGLRenderTarget(1, 1, {
    format: RedFormat,
    type: HalfFloatType,
  });
  private readonly backgroundPicture = new WebGLRenderTarget(1, 1, { depthBuffer: false });
  private backgroundKey = ''; // what it was drawn for
  private smooth: WebGLRenderTarget | undefined;
  private hasRestPositions = false;
  private readonly mesh = new Mesh(this.surface.triangles, this.liquid.liquid);
  private readonly body = new Mesh(this.surface.triangles, this.liquid.thickness);
  private readonly wire = new LineSegments(this.surface.lines, this.plain.wire);
  private readonly box = new Box3();
  private look: Look = {
    shading: 'plain',
    wireframe: false,
    pattern: false,
    theme: 'light',
  };

  constructor(readonly canvas: HTMLCanvasElement) {
    this.renderer = new WebGLRenderer({ canvas, antialias: !this.software, alpha: false });
    this.renderer.outputColorSpace = LinearSRGBColorSpace;
    this.renderer.autoClear = false;
    // Sorting would go by spheres around the surfaces of the first frames.
    this.renderer.sortObjects = false;
    this.renderer.info.autoReset = false;
    const screen = new BufferGeometry();
    const corners = new Float32Array([-1, -1, 0, 3, -1, 0, -1, 3, 0]);
    screen.setAttribute('position', new BufferAttribute(corners, 3));
    this.background.add(still(new Mesh(screen, this.liquid.background)));
    this.copies.add(still(new Mesh(screen, this.liquid.copy)));
    this.hidden.add(still(this.body));
    this.scene.add(still(this.mesh), still(this.wire), this.surroundings.group);
    this.liquid.liquid.uniforms.thickness!.value = this.thickness.texture;
  }

  /** What the camera turns around. */
  get sphere(): OrbitSphere {
    const { center, radius } = this.box.getBoundingSphere(new Sphere());
    return { center: [center.x, center.y, center.z], radius: radius || 1 };
  }

  get aspect(): number {
    return this.camera.aspect;
  }

  setWorld(box: Box3, rotation: Matrix4): void {
    this.box.copy(box);
    setBox(this.studio, box);
    this.backgroundKey = '';
    this.surroundings.setBox(box);
    for (const object of [this.mesh, this.body, this.wire]) {
      object.matrix.copy(rotation);
      object.matrixWorldNeedsUpdate = true;
    }
  }

  setLook(look: Look): void {
    this.look = look;
    const liquid = look.shading === 'liquid';
    this.mesh.material = liquid ? this.liquid.liquid : this.plain.surface;
    this.wire.visible = look.wireframe;
    this.showPattern();
    this.surroundings.showGrid(!liquid);
    this.surroundings.setTheme(look.theme);
    setTheme(this.studio, look.theme);
    setPlainTheme(this.plain, look.theme);
  }

  /** Size in CSS pixels, and how many pixels of the picture are one of those. */
  setSize(width: number, height: number, ratio: number): void {
    this.renderer.setPixelRatio(ratio);
    this.renderer.setSize(width, height, false);
    const { canvas } = this;
    this.thickness.setSize(Math.ceil(canvas.width / 2), Math.ceil(canvas.height / 2));
    this.backgroundPicture.setSize(canvas.width, canvas.height);
    this.backgroundKey = '';
    this.studio.resolution!.value.set(canvas.width, canvas.height);
    this.camera.aspect = width / Math.max(1, height);
  }

  show(frame: DecodedFrame): void {
    this.surface.update(frame.buffers, frame.counts);
    this.hasRestPositions = frame.counts.hasRestPositions;
    this.showPattern();
  }

  /** `fine`: with smooth edges, even where that takes long. */
  render(orbit: Orbit, fine: boolean): void {
    this.place(orbit);
    const { renderer } = this;
    const output = fine && this.software ? this.smoothTarget() : null;
    renderer.info.reset();
    if (this.look.shading === 'liquid') {
      this.renderLiquid(output, JSON.stringify([orbit, this.look.theme]));
    } else {
      renderer.setRenderTarget(output);
      renderer.setClearColor(new Color(palettes[this.look.theme].horizon), 1);
      renderer.clear();
    }
    renderer.render(this.scene, this.camera);
    if (output) this.copy(output, null);
  }

  dispose(): void {
    this.surface.dispose();
    this.surroundings.dispose();
    this.thickness.dispose();
    this.backgroundPicture.dispose();
    this.smooth?.dispose();
    this.renderer.dispose();
    this.renderer.forceContextLoss();
  }

  private showPattern(): void {
    const isShown = this.look.pattern && this.hasRestPositions;
    this.studio.patternShare!.value = isShown ? patternShare : 0;
  }

  // The background is drawn anew only if the camera has moved.
  private renderLiquid(output: WebGLRenderTarget | null, backgroundKey: string): void {
    const { renderer } = this;
    if (backgroundKey !== this.backgroundKey) {
      this.backgroundKey = backgroundKey;
      renderer.setRenderTarget(this.backgroundPicture);
      renderer.render(this.background, this.camera);
    }
    renderer.setRenderTarget(this.thickness);
    renderer.setClearColor(0x000000, 0);
    renderer.clear();
    renderer.render(this.hidden, this.camera);
    this.copy(this.backgroundPicture, output);
  }

  private copy(from: WebGLRenderTarget, to: WebGLRenderTarget | null): void {
    this.liquid.copy.uniforms.picture!.value = from.texture;
    this.renderer.setRenderTarget(to);
    this.renderer.clear();
    this.renderer.render(this.copies, this.camera);
  }

  // Where WebGL draws by the processor, smooth edges are for still pictures only.
  private smoothTarget(): WebGLRenderTarget {
    this.smooth ??= new WebGLRenderTarget(1, 1, { samples: 4 });
    this.smooth.setSize(this.canvas.width, this.canvas.height);
    return this.smooth;
  }

  private place(orbit: Orbit): void {
    const { camera } = this;
    const { radius } = this.sphere;
    camera.position.set(...eyeOf(orbit));
    camera.up.set(0, 1, 0);
    camera.lookAt(...orbit.target);
    camera.near = Math.max(orbit.distance - 4 * radius, 0.02 * Math.min(orbit.distance, radius));
    camera.far = orbit.distance + 8 * radius;
    camera.updateProjectionMatrix();
    camera.updateMatrixWorld();
    const toWorld = camera.matrixWorld.clone().multiply(camera.projectionMatrixInverse);
    this.liquid.background.uniforms.toWorld!.value = toWorld;
  }
}

// An object that is placed by its matrix alone and always drawn.
function still<T extends Mesh | LineSegments>(object: T): T {
  object.matrixAutoUpdate = false;
  object.frustumCulled = false;
  return object;
}
