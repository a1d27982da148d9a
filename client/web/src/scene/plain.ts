// Plain shading: matt, lit from the camera and from above; and the lines of its wireframe.
import { Color, GLSL3, LineBasicMaterial, ShaderMaterial } from 'three';
import { palettes, patternShader, setLight, type SceneTheme, type Uniforms } from './studio.ts';

const vertexShader = /* glsl */ `
  in vec4 rest;
  out float light;
  out vec3 worldRest;
  void main() {
    vec4 at = modelViewMatrix * vec4(position, 1.0);
    worldRest = (modelMatrix * vec4(rest.xyz, 1.0)).xyz;
    vec3 n = normalize(mat3(modelViewMatrix) * normal);
    vec3 up = mat3(viewMatrix) * vec3(0.0, 1.0, 0.0);
    float lamp = max(dot(n, normalize(vec3(0.3, 0.5, 1.0))), 0.0);
    light = 0.45 + 0.42 * lamp + 0.15 * dot(n, up);
    gl_Position = projectionMatrix * at;
  }
`;

const fragmentShader = /* glsl */ `
  precision highp float;
  in float light;
  in vec3 worldRest;
  out vec4 color;
  uniform vec3 albedo;
  ${patternShader}
  void main() {
    vec3 shaded = pow(albedo * light, vec3(1.0 / 2.2));
    color = vec4(patterned(shaded, worldRest), 1.0);
  }
`;

export interface PlainMaterials {
  surface: ShaderMaterial;
  wire: LineBasicMaterial;
}

export function plainMaterials(studio: Uniforms): PlainMaterials {
  const surface = new ShaderMaterial({
    glslVersion: GLSL3,
    uniforms: { ...studio, albedo: { value: new Color() } },
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
