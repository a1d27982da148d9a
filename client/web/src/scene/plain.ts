// Plain shading: matt, lit from the camera and from above; and the lines of its wireframe.
import { Color, GLSL3, LineBasicMaterial, ShaderMaterial } from 'three';
import { palettes, setLight, type SceneTheme } from './studio.ts';

const vertexShader = /* glsl */ `
  out float light;
  void main() {
    vec4 at = modelViewMatrix * vec4(position, 1.0);
    vec3 n = normalize(mat3(modelViewMatrix) * normal);
    vec3 up = mat3(viewMatrix) * vec3(0.0, 1.0, 0.0);
    float lamp = max(dot(n, normalize(vec3(0.3, 0.5, 1.0))), 0.0);
    light = 0.45 + 0.42 * lamp + 0.15 * dot(n, up);
    gl_Position = projectionMatrix * at;
  }
`;

const fragmentShader = /* glsl */ `
  precision mediump float;
  in float light;
  out vec4 color;
  uniform vec3 albedo;
  void main() {
    color = vec4(pow(albedo * light, vec3(1.0 / 2.2)), 1.0);
  }
`;

export interface PlainMaterials {
  surface: ShaderMaterial;
  wire: LineBasicMaterial;
}

export function plainMaterials(): PlainMaterials {
  const surface = new ShaderMaterial({
    glslVersion: GLSL3,
    uniforms: { albedo: { value: new Color() } },
    vertexShader,
    fragmentShader,
    polygonOffset: true,
    polygonOffsetFactor: 1,
    polygonOffsetUnits: 1,
  });
  return { surface, wire: new LineBasicMaterial({ transparent: true, opacity: 0.55 }) };
}

export function setPlainTheme({ surface, wire }: PlainMaterials, theme: SceneTheme): void {
  setLight(surface.uniforms.albedo!, palettes[theme].plain);
  wire.color.set(palettes[theme].wire);
}
