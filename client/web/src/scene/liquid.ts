// Liquid shading: the room seen by reflection and refraction, tinted by the way through the liquid.
import {
  AdditiveBlending,
  DoubleSide,
  FrontSide,
  GLSL3,
  ShaderMaterial,
  type Texture,
} from 'three';
import { patternShader, studioShader, type Uniforms } from './studio.ts';

const worldVertex = /* glsl */ `
  in vec4 rest;
  out vec3 world;
  out vec3 worldNormal;
  out vec3 worldRest;
  void main() {
    vec4 at = modelMatrix * vec4(position, 1.0);
    world = at.xyz;
    worldRest = (modelMatrix * vec4(rest.xyz, 1.0)).xyz;
    worldNormal = mat3(modelMatrix) * normal;
    gl_Position = projectionMatrix * viewMatrix * at;
  }
`;

const backgroundVertex = /* glsl */ `
  out vec3 ray;
  uniform mat4 toWorld;
  void main() {
    vec4 far = toWorld * vec4(position.xy, 1.0, 1.0);
    ray = far.xyz / far.w - cameraPosition;
    gl_Position = vec4(position.xy, 1.0, 1.0);
  }
`;

const backgroundFragment = /* glsl */ `
  precision highp float;
  in vec3 ray;
  out vec4 color;
  ${studioShader}
  void main() {
    vec3 d = normalize(ray);
    vec3 above = mix(horizonColor, zenithColor, 0.5 * smoothstep(0.0, 0.9, d.y));
    vec3 seen = d.y < 0.0 ? studio(cameraPosition, d) : above;
    color = vec4(display(seen), 1.0);
  }
`;

const copyVertex = /* glsl */ `
  void main() {
    gl_Position = vec4(position.xy, 1.0, 1.0);
  }
`;

const copyFragment = /* glsl */ `
  precision mediump float;
  uniform sampler2D picture;
  out vec4 color;
  void main() {
    color = texelFetch(picture, ivec2(gl_FragCoord.xy), 0);
  }
`;

// Sums the distances of back faces minus those of front faces: the way through the liquid.
const thicknessFragment = /* glsl */ `
  precision highp float;
  in vec3 world;
  in vec3 worldNormal;
  out vec4 color;
  uniform vec3 boxCenter;
  void main() {
    float way = distance(world, cameraPosition) - distance(boxCenter, cameraPosition);
    color = vec4(gl_FrontFacing ? -way : way, 0.0, 0.0, 1.0);
  }
`;

const liquidFragment = /* glsl */ `
  precision highp float;
  in vec3 world;
  in vec3 worldNormal;
  in vec3 worldRest;
  out vec4 color;
  uniform sampler2D thickness;
  uniform vec2 resolution;
  uniform vec3 bodyColor;
  ${studioShader}
  ${patternShader}

  const vec3 absorption = vec3(5.2, 1.1, 0.55);
  const vec3 sun = normalize(vec3(-0.42, 0.78, -0.36));

  void main() {
    vec3 view = normalize(world - cameraPosition);
    vec3 n = normalize(worldNormal);
    n = normalize(n - view * max(dot(n, view) + 0.02, 0.0));
    float facing = clamp(-dot(n, view), 0.0, 1.0);
    float fresnel = 0.02 + 0.98 * pow(1.0 - facing, 5.0);

    float way = texture(thickness, gl_FragCoord.xy / resolution).r / sceneSize;
    vec3 behind = studio(world, refract(view, n, 1.0 / 1.33));
    vec3 scattered = bodyColor * (1.0 - exp(-3.2 * max(way, 0.0))) * (0.64 + 0.4 * n.y);
    vec3 body = behind * exp(-absorption * max(way, 0.0)) + scattered;

    vec3 mirrored = reflect(view, n);
    vec3 glint = vec3(pow(max(dot(mirrored, sun), 0.0), 220.0)) * 1.6 * lamp;
    vec3 shaded = display(mix(body, studio(world, mirrored), fresnel) + glint);
    color = vec4(patterned(shaded, worldRest), 1.0);
  }
`;

export interface LiquidMaterials {
  background: ShaderMaterial;
  copy: ShaderMaterial;
  thickness: ShaderMaterial;
  liquid: ShaderMaterial;
}

export function liquidMaterials(studio: Uniforms): LiquidMaterials {
  const glslVersion = GLSL3;
  const behind = { glslVersion, depthTest: false, depthWrite: false };
  const background = new ShaderMaterial({
    ...behind,
    uniforms: { ...studio, toWorld: { value: null } },
    vertexShader: backgroundVertex,
    fragmentShader: backgroundFragment,
  });
  const copy = new ShaderMaterial({
    ...behind,
    uniforms: { picture: { value: null as Texture | null } },
    vertexShader: copyVertex,
    fragmentShader: copyFragment,
  });
  const thickness = new ShaderMaterial({
    glslVersion,
    uniforms: studio,
    vertexShader: worldVertex,
    fragmentShader: thicknessFragment,
    blending: AdditiveBlending,
    side: DoubleSide,
    depthTest: false,
    depthWrite: false,
    transparent: true,
  });
  const liquid = new ShaderMaterial({
    glslVersion,
    uniforms: { ...studio, thickness: { value: null as Texture | null } },
    vertexShader: worldVertex,
    fragmentShader: liquidFragment,
    side: FrontSide,
  });
  return { background, copy, thickness, liquid };
}
