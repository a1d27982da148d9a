#include "game.h"

#include <stdio.h>

static const double kEase_s = 0.25; /* how long the liquid takes to follow a lever */

void game_set_playing(struct game* game, bool is_playing) {
  game->is_playing = is_playing;
  if (is_playing) {
    lb_player_play(game->player);
  } else {
    lb_player_pause(game->player);
  }
}

void game_seek(struct game* game, double time_s) {
  if (lb_player_seek(game->player, time_s) == LB_OK) return;
  fprintf(stderr, "splash: %s\n", lb_last_error());
  game->has_failed = true;
}

void game_move_lever(struct game* game, int lever, double share) {
  game->levers.chosen = lever;
  if (!levers_move(&game->levers, lever, share)) return;
  if (!levers_send(&game->levers, kEase_s)) game->has_failed = true;
}
