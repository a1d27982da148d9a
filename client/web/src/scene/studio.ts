// The room around the liquid: ground, sky and lights, as a function that every ray can ask.
import { Color, Vector2, Vector3, type Box3, type IUniform } from 'three';

export type SceneTheme = 'light' | 'dark';

interface Palette {
  horizon: string;
  zenith: string;
  ground: string;
  line: string;
  lamp: number;
  body: string; // of thick liquid
  plain: string;
  wire: string;
  box: string;
  pattern: string;
}

export const palettes: Record<SceneTheme, Palette> = {
  light: {
    horizon: '#f4f7f9',
    zenith: '#a4bfd2',
    ground: '#e7ecef',
    line: '#c6d0d7',
    lamp: 1.15,
    body: '#2a86a8',
    plain: '#5d93ad',
    wire: '#0c3a50',
    box: '#7d8e99',
    pattern: '#fdf6e3',
  },
  dark: {
    horizon: '#18222a',
    zenith: '#355062',
    ground: '#222e37',
    line: '#33424d',
    lamp: 1.25,
    body: '#1a6a90',
    plain: '#6fa9c4',
    wire: '#06202d',
    box: '#5d7280',
    pattern: '#dcebf2',
  },
};

export type Uniforms = Record<string, IUniform>;

/** Shared by all materials of a stage. */
export function studioUniforms(): Uniforms {
  return {
    horizonColor: { value: new Color() },
    zenithColor: { value: new Color() },
    groundColor: { value: new Color() },
    lineColor: { value: new Color() },
    lamp: { value: 1 },
    bodyColor: { value: new Color() },
    boxCenter: { value: new Vector3() },
    boxHalf: { value: new Vector3(1, 1, 1) },
    sceneSize: { value: 1 },
    gridStep: { value: 1 },
    resolution: { value: new Vector2(1, 1) },
    patternShare: { value: 0 }, // 0: no pattern
    patternStep: { value: 1 },
    patternColor: { value: new Color() },
  };
}

// A colour of the screen as an amount of light.
export function setLight(uniform: IUniform<Color>, color: string): void {
  uniform.value.set(color).convertSRGBToLinear();
}

export function setTheme(uniforms: Uniforms, theme: SceneTheme): void {
  const palette = palettes[theme];
  setLight(uniforms.horizonColor!, palette.horizon);
  setLight(uniforms.zenithColor!, palette.zenith);
  setLight(uniforms.groundColor!, palette.ground);
  setLight(uniforms.lineColor!, palette.line);
  uniforms.lamp!.value = palette.lamp;
  setLight(uniforms.bodyColor!, palette.body);
  uniforms.patternColor!.value.set(palette.pattern);
}

/** A round length that divides the box into some 8 squares. */
export function gridStepOf(size: number): number {
  const step = size / 8;
  const power = 10 ** Math.floor(Math.log10(step));
  const mantissa = step / power;
  return power * (mantissa < 1.5 ? 1 : mantissa < 3.5 ? 2 : mantissa < 7.5 ? 5 : 10);
}

export function setBox(uniforms: Uniforms, box: Box3): void {
  const size = box.getSize(new Vector3());
  box.getCenter(uniforms.boxCenter!.value);
  uniforms.boxHalf!.value.copy(size).multiplyScalar(0.5);
  uniforms.sceneSize!.value = size.length();
  uniforms.gridStep!.value = gridStepOf(Math.max(size.x, size.z));
  uniforms.patternStep!.value = 0.25 * uniforms.gridStep!.value;
}

/**
 * GLSL: `patterned(color, rest)` is the colour under a grid that is painted, from above, on the
 * source, so that it stays on a place of the liquid while weights change.
 */
export const patternShader = /* glsl */ `
  uniform float patternShare, patternStep;
  uniform vec3 patternColor;

  vec3 patterned(vec3 color, vec3 rest) {
    vec2 p = rest.xz / patternStep;
    vec2 toLine = abs(fract(p - 0.5) - 0.5);
    vec2 softness = max(fwidth(p), 1e-4);
    vec2 lines = 1.0 - smoothstep(vec2(0.045), vec2(0.045) + softness, toLine);
    return mix(color, patternColor, patternShare * max(lines.x, lines.y));
  }
`;

/** GLSL: `studio(origin, direction)` is the light that comes along a ray, without the liquid. */
export const studioShader = /* glsl */ `
  uniform vec3 horizonColor, zenithColor, groundColor, lineColor;
  uniform float lamp, sceneSize, gridStep;
  uniform vec3 boxCenter, boxHalf;

  float panel(vec2 p, vec2 center, vec2 size) {
    vec2 d = smoothstep(size + 0.12, size - 0.05, abs(p - center));
    return d.x * d.y;
  }

  vec3 sky(vec3 d) {
    vec3 color = mix(horizonColor, zenithColor, smoothstep(0.0, 0.75, d.y));
    vec2 ceiling = d.xz / max(d.y, 0.08);
    color += lamp * panel(ceiling, vec2(-0.55, -0.5), vec2(0.55, 0.3));
    color += 0.16 * lamp * exp(-pow((d.y - 0.2) / 0.14, 2.0));
    color += 0.6 * lamp * panel(ceiling, vec2(1.5, 0.9), vec2(0.25, 0.9));
    return color;
  }

  float gridLine(vec2 p, float softness) {
    vec2 d = abs(fract(p / gridStep - 0.5) - 0.5) * gridStep;
    float width = 0.0007 * sceneSize;
    return 1.0 - smoothstep(width, width + softness, min(d.x, d.y));
  }

  vec3 ground(vec3 p, float way) {
    vec2 q = p.xz - boxCenter.xz;
    float line = gridLine(q, 0.0007 * way + 0.0002 * sceneSize);
    vec3 color = mix(groundColor, lineColor, line * 0.85);
    float outside = length(max(abs(q) - boxHalf.xz, 0.0)) / sceneSize;
    color *= 1.0 - 0.28 * exp(-14.0 * outside);
    return mix(color, horizonColor, smoothstep(0.5, 2.2, length(q) / sceneSize));
  }

  vec3 studio(vec3 origin, vec3 direction) {
    float floorY = boxCenter.y - boxHalf.y;
    float way = (floorY - origin.y) / direction.y;
    if (direction.y > -1e-4 || way < 0.0) return sky(direction);
    return ground(origin + way * direction, way);
  }

  vec3 display(vec3 color) {
    color = max(color, 0.0);
    vec3 compressed = 1.0 - exp(-color * 1.0);
    color = mix(color, compressed, smoothstep(0.75, 1.6, max(color.r, max(color.g, color.b))));
    return mix(color * 12.92, 1.055 * pow(color, vec3(1.0 / 2.4)) - 0.055, step(0.0031308, color));
  }
`;
