#include "camera.h"

#include <math.h>
#include <string.h>

static const float kHalfAngle = 0.3f; /* of the view, upward, in radians */
static const float kMargin = 0.98f;

/* The world's axis that the scene's x, y or z lies along, with its sign. */
struct axis {
  int index;
  float sign;
};

/* Up becomes y, and the longer of the other two x. */
static void choose_axes(const lb_family_info* family, const double* size, struct axis axes[3]) {
  const lb_up up = family->up == LB_UP_UNKNOWN ? LB_UP_Z : family->up;
  const int y = (int)(up - 1) % 3, next = (y + 1) % 3, other = (y + 2) % 3;
  const int x = size[next] >= size[other] ? next : other;
  axes[0] = (struct axis){x, 1.0f};
  axes[1] = (struct axis){y, up <= LB_UP_Z ? 1.0f : -1.0f};
  /* z is x cross y: unit vectors in a cyclic order give plus the third. */
  axes[2] = (struct axis){3 - x - y, (x + 1) % 3 == y ? axes[1].sign : -axes[1].sign};
}

struct camera camera_of(const lb_family_info* family) {
  struct camera camera = {.yaw = 0.25f, .pitch = 0.36f, .closer = 1.0f};
  double size[3], diagonal_sq = 0.0;
  for (int k = 0; k < 3; ++k) {
    size[k] = family->bounds_max[k] - family->bounds_min[k];
    diagonal_sq += size[k] * size[k];
  }
  const double scale = diagonal_sq > 0.0 ? 2.0 / sqrt(diagonal_sq) : 1.0;
  struct axis axes[3];
  choose_axes(family, size, axes);
  for (int row = 0; row < 3; ++row) {
    const int k = axes[row].index;
    const double entry = scale * axes[row].sign;
    const double middle = 0.5 * (family->bounds_min[k] + family->bounds_max[k]);
    camera.scene_from_world[4 * k + row] = (float)entry;
    camera.scene_from_world[12 + row] = (float)(-entry * middle);
    camera.half[row] = (float)(0.5 * scale * size[k]);
  }
  camera.scene_from_world[15] = 1.0f;
  return camera;
}

void camera_turn(struct camera* camera, float yaw, float pitch) {
  camera->yaw += yaw;
  camera->pitch = fminf(fmaxf(camera->pitch + pitch, 0.02f), 1.5f);
}

void camera_approach(struct camera* camera, float steps) {
  camera->closer = fminf(fmaxf(camera->closer * powf(1.1f, steps), 0.4f), 2.5f);
}

static float dot(const float* a, const float* b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

/* How far the eye has to be to see all of the box. */
static float fitting_distance(const float half[3], float axes[3][3], float aspect) {
  const float tan_up = tanf(kHalfAngle), tan_side = tan_up * aspect;
  float distance = 0.0f;
  for (int corner = 0; corner < 8; ++corner) {
    const float at[3] = {corner & 1 ? half[0] : -half[0], corner & 2 ? half[1] : -half[1],
                         corner & 4 ? half[2] : -half[2]};
    const float side = fabsf(dot(axes[0], at)) / tan_side, up = fabsf(dot(axes[1], at)) / tan_up;
    distance = fmaxf(distance, dot(axes[2], at) + fmaxf(side, up));
  }
  return distance;
}

struct view camera_view(const struct camera* camera, float aspect) {
  const float cy = cosf(camera->yaw), sy = sinf(camera->yaw);
  const float cp = cosf(camera->pitch), sp = sinf(camera->pitch);
  /* Right, up, and towards the eye. */
  float axes[3][3] = {{cy, 0.0f, -sy}, {-sp * sy, cp, -sp * cy}, {cp * sy, sp, cp * cy}};
  const float distance = kMargin * fitting_distance(camera->half, axes, aspect) / camera->closer;
  const float near = 0.02f, far = distance + 3.0f;
  const float scale[3] = {1.0f / (aspect * tanf(kHalfAngle)), 1.0f / tanf(kHalfAngle),
                          (far + near) / (near - far)};
  struct view view;
  memset(&view, 0, sizeof view);
  for (int k = 0; k < 3; ++k) {
    view.eye[k] = distance * axes[2][k];
    view.right[k] = axes[0][k] / scale[0];
    view.up[k] = axes[1][k] / scale[1];
    view.forward[k] = -axes[2][k];
    for (int row = 0; row < 3; ++row) view.clip_from_scene[4 * k + row] = scale[row] * axes[row][k];
    view.clip_from_scene[4 * k + 3] = -axes[2][k];
  }
  view.clip_from_scene[14] = -distance * scale[2] + 2.0f * far * near / (near - far);
  view.clip_from_scene[15] = distance;
  return view;
}
