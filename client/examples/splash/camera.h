/* A camera that turns around the liquid. It works in the scene's own space, where up is +y, the
 * middle of the family's bounds is 0, and half their diagonal is 1. Matrices are as OpenGL has
 * them, column by column. */
#pragma once

#include <liquidblend/liquidblend.h>

struct camera {
  float scene_from_world[16];
  float half[3]; /* size of the bounds, in the scene */
  float yaw, pitch;
  float closer; /* 1: all is seen */
};

struct view {
  float clip_from_scene[16];
  float eye[3];
  float right[3], up[3], forward[3]; /* forward + x right + y up: the ray at (x, y) of clip space */
};

struct camera camera_of(const lb_family_info* family);
void camera_turn(struct camera* camera, float yaw, float pitch);
void camera_approach(struct camera* camera, float steps);
struct view camera_view(const struct camera* camera, float aspect);
