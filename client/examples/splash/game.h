/* All that changes while it plays. */
#pragma once

#include <stdbool.h>

#include "camera.h"
#include "levers.h"
#include "overlay.h"
#include "water.h"

struct GLFWwindow;

struct mouse {
  double x, y;     /* at the last look, and ... */
  bool is_pressed; /* ... so is this */
  int held;        /* lever that it holds; -1: none */
};

struct game {
  lb_player* player;
  struct GLFWwindow* window; /* whose user pointer is the game */
  struct levers levers;
  struct camera camera;
  struct water water;
  struct overlay overlay;
  struct mouse mouse;
  bool is_playing;
  bool has_failed; /* which was said */
};

/* These say what has failed, too. */
void game_set_playing(struct game* game, bool is_playing);
void game_seek(struct game* game, double time_s);
void game_move_lever(struct game* game, int lever, double share);
