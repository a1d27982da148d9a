/* Whether the camera of the game shows the whole of the bounds, upright and not mirrored, whatever
 * is up. */
#include <math.h>
#include <stdio.h>
#include <string.h>

#include "camera.h"

static int num_failures = 0;

static void expect(int is_so, const char* what, int up) {
  if (is_so) return;
  printf("up %d: %s\n", up, what);
  ++num_failures;
}

/* m * (x, y, z, w), column by column. */
static void transform(const float m[16], const float in[4], float out[4]) {
  for (int row = 0; row < 4; ++row) {
    out[row] = 0.0f;
    for (int k = 0; k < 4; ++k) out[row] += m[4 * k + row] * in[k];
  }
}

static float determinant(const float m[16]) {
  return m[0] * (m[5] * m[10] - m[6] * m[9]) - m[4] * (m[1] * m[10] - m[2] * m[9]) +
         m[8] * (m[1] * m[6] - m[2] * m[5]);
}

static void check_axes(const struct camera* camera, int up) {
  const int axis = up == 0 ? 2 : (up - 1) % 3;
  float upward[4] = {0.0f}, in_scene[4];
  upward[axis] = up > 3 ? -1.0f : 1.0f;
  transform(camera->scene_from_world, upward, in_scene);
  expect(in_scene[1] > 0.0f && in_scene[0] == 0.0f && in_scene[2] == 0.0f, "up is not y", up);
  expect(determinant(camera->scene_from_world) > 0.0f, "it is mirrored", up);
}

static void check_corners(const lb_family_info* family, const struct camera* camera, int up) {
  const float aspects[] = {0.5f, 1.0f, 1.6f};
  for (int k = 0; k < 3 * 8; ++k) {
    const struct view view = camera_view(camera, aspects[k / 8]);
    float corner[4] = {0.0f, 0.0f, 0.0f, 1.0f}, in_scene[4], clip[4];
    for (int axis = 0; axis < 3; ++axis) {
      const double* bounds = (k >> axis) & 1 ? family->bounds_max : family->bounds_min;
      corner[axis] = (float)bounds[axis];
    }
    transform(camera->scene_from_world, corner, in_scene);
    transform(view.clip_from_scene, in_scene, clip);
    const float limit = 1.05f * clip[3]; /* the margin cuts a little of the empty corners */
    expect(clip[3] > 0.0f && fabsf(clip[0]) <= limit && fabsf(clip[1]) <= limit &&
               fabsf(clip[2]) <= clip[3],
           "a corner is out of sight", up);
  }
}

int main(void) {
  for (int up = LB_UP_UNKNOWN; up <= LB_UP_MINUS_Z; ++up) {
    const lb_family_info family = {.struct_size = sizeof family,
                                   .up = (lb_up)up,
                                   .bounds_min = {10.0, -3.0, 0.5},
                                   .bounds_max = {11.0, 4.0, 2.5}};
    struct camera camera = camera_of(&family);
    check_axes(&camera, up);
    check_corners(&family, &camera, up);
    camera_turn(&camera, 2.0f, 0.5f);
    check_corners(&family, &camera, up);
  }
  return num_failures == 0 ? 0 : 1;
}
