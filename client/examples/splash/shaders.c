#include "shaders.h"

/* struct block of water.c; what rays see that hit no water: a tiled floor under a sky. Backdrop,
 * reflections and refractions all look it up. */
const char kSurroundings[] =
    "layout(std140) uniform Scene {\n"
    "  mat4 scene_from_world, clip_from_scene;\n"
    "  vec3 half_size, eye, right, up, forward;\n"
    "};\n"
    "const vec3 kSun = vec3(-0.42, 0.78, 0.46);\n"
    "vec3 sky(vec3 ray) {\n"
    "  vec3 color = mix(vec3(0.72, 0.79, 0.86), vec3(0.16, 0.36, 0.68), sqrt(max(ray.y, 0.0)));\n"
    "  return color + vec3(2.6, 2.4, 2.1) * smoothstep(0.985, 0.998, dot(ray, kSun));\n"
    "}\n"
    "float tiles(vec2 at, float blur) {\n"
    "  vec2 from_line = abs(fract(at * 5.0) - 0.5) - 0.02;\n"
    "  vec2 line = smoothstep(vec2(-blur), vec2(blur), from_line);\n"
    "  return min(line.x, line.y);\n"
    "}\n"
    "vec3 surroundings(vec3 from, vec3 ray, float blur) {\n"
    "  if (ray.y > -0.001) return sky(ray);\n"
    "  float distance = (from.y + half_size.y + 0.004) / -ray.y;\n"
    "  vec3 at = from + max(distance, 0.0) * ray;\n"
    "  blur += 0.01 * length(at - eye) / max(-ray.y, 0.1);\n"
    "  vec3 color = mix(vec3(0.40, 0.43, 0.45), vec3(0.66, 0.68, 0.68), tiles(at.xz, blur));\n"
    "  float away = length(max(abs(at.xz) - half_size.xz, 0.0));\n"
    "  color *= 1.0 - 0.4 * exp(-14.0 * away);\n"
    "  return mix(color, vec3(0.72, 0.79, 0.86), 1.0 - exp(-0.12 * dot(at.xz, at.xz)));\n"
    "}\n"
    "vec3 displayed(vec3 linear) { return pow(linear, vec3(1.0 / 2.2)); }\n";

/* One triangle that covers the screen. */
const char kBackdropVertex[] =
    "out vec3 ray;\n"
    "void main() {\n"
    "  vec2 corner = vec2(gl_VertexID == 1 ? 3.0 : -1.0, gl_VertexID == 2 ? 3.0 : -1.0);\n"
    "  gl_Position = vec4(corner, 1.0, 1.0);\n"
    "  ray = forward + corner.x * right + corner.y * up;\n"
    "}\n";

const char kBackdropFragment[] =
    "in vec3 ray;\n"
    "out vec4 color;\n"
    "void main() { color = vec4(displayed(surroundings(eye, normalize(ray), 0.01)), 1.0); }\n";

const char kWaterVertex[] =
    "layout(location = 0) in vec3 position;\n"
    "layout(location = 1) in vec3 normal;\n"
    "out vec3 at, outward;\n"
    "void main() {\n"
    "  at = (scene_from_world * vec4(position, 1.0)).xyz;\n"
    "  outward = mat3(scene_from_world) * normal;\n"
    "  gl_Position = clip_from_scene * vec4(at, 1.0);\n"
    "}\n";

/* Summed up over all triangles of a pixel, this is the length of its ray in the water: the surface
 * is closed, so that each way in has a way out. */
const char kDepthFragment[] =
    "in vec3 at;\n"
    "out float signed_distance;\n"
    "void main() {\n"
    "  float distance = length(at - eye);\n"
    "  signed_distance = gl_FrontFacing ? -distance : distance;\n"
    "}\n";

const char kWaterFragment[] =
    "uniform sampler2D thickness;\n"
    "in vec3 at, outward;\n"
    "out vec4 color;\n"
    "const vec3 kAbsorption = vec3(7.5, 2.0, 0.7);\n"
    "const vec3 kBody = vec3(0.01, 0.16, 0.40);\n"
    "void main() {\n"
    "  vec3 ray = normalize(at - eye), normal = normalize(outward);\n"
    "  float facing = -dot(normal, ray);\n"
    "  if (facing < 0.1) {\n" /* a smooth normal may turn away at a silhouette */
    "    normal = normalize(normal - (0.1 - facing) * ray);\n"
    "    facing = 0.1;\n"
    "  }\n"
    "  float mirror = 0.02 + 0.98 * pow(1.0 - facing, 5.0);\n" /* Schlick's Fresnel, of water */
    "  float depth = max(texelFetch(thickness, ivec2(gl_FragCoord.xy), 0).r, 0.0);\n"
    "  vec3 clear = exp(-kAbsorption * depth);\n"
    "  vec3 behind = surroundings(at, refract(ray, normal, 1.0 / 1.33), 0.05);\n"
    "  vec3 body = kBody * (0.7 + 0.5 * max(dot(normal, kSun), 0.0));\n"
    "  vec3 through = mix(body, behind, clear);\n"
    "  vec3 mirrored = surroundings(at, reflect(ray, normal), 0.05);\n"
    "  color = vec4(displayed(mix(through, mirrored, mirror)), 1.0);\n"
    "}\n";
