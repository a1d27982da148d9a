/* splash: a game of one scene. Levers set where and from how high a drop falls, or whatever else
 * the animations of a family differ in. It shows how a game uses liquidblend.h: the player is in
 * this file, blends are in levers.c, frames become vertex buffers in water.c. */
#include <liquidblend/liquidblend.h>
#include <stdio.h>
#define GLFW_INCLUDE_NONE
#include <GLFW/glfw3.h>

#include "figures.h"
#include "game.h"
#include "gl.h"
#include "input.h"
#include "options.h"

enum { EXIT_DONE = 0, EXIT_FAILED = 1, EXIT_REFUSED = 2 };

static const double kPatience_s = 60.0; /* of --seconds, for the first frame */

/* What the library would otherwise keep to itself: that a server is gone, and that it is back. */
static void print_line(void* user, const char* message) {
  (void)user;
  fprintf(stderr, "splash: %s\n", message);
}

/* Waits for the server, or until the file is read. Nothing after it waits. */
static bool open_player(const struct options* options, lb_player** player) {
  const lb_connect_options connect = {.struct_size = sizeof connect, .target = options->server};
  const lb_surface surface = {
      .struct_size = sizeof surface, .attributes = kWaterAttributes, .smoothing_passes = 3};
  const lb_player_options player_options = {.struct_size = sizeof player_options,
                                            .file = options->file,
                                            .connect = &connect,
                                            .family = options->family,
                                            .surface = &surface,
                                            .log = print_line};
  const lb_status status = lb_player_open(&player_options, player);
  if (status == LB_OK) return true;
  fprintf(stderr, "splash: %s: %s\n", lb_status_name(status), lb_last_error());
  return false;
}

/* The player's course from the first picture on. */
static void start(struct game* game, const struct options* options) {
  const bool is_paused = options->time_s >= 0.0;
  lb_player_set_loop(game->player, 1);
  game_seek(game, is_paused ? options->time_s : 0.0);
  game_set_playing(game, !is_paused);
}

static bool open_scene(struct game* game, const struct options* options) {
  lb_family_info family = {.struct_size = sizeof family};
  lb_player_describe(game->player, &family);
  game->camera = camera_of(&family);
  game->window = open_window(options->width, options->height, options->num_samples, options->vsync);
  if (game->window == NULL) return false;
  input_open(game);
  return water_open(&game->water) && overlay_open(&game->overlay);
}

static bool draw(struct game* game) {
  int width, height, window_width, window_height;
  glfwGetFramebufferSize(game->window, &width, &height);
  glfwGetWindowSize(game->window, &window_width, &window_height);
  if (width == 0 || height == 0) return true; /* an icon */
  water_draw(&game->water, &game->camera, width, height);
  overlay_draw(&game->overlay, &game->levers, window_width, window_height);
  return gl_is_well("draw");
}

/* The figures of the last half second, in the window's title. */
static void show_figures(struct game* game, struct figures* newest, double now) {
  if (now - newest->since < 0.5 || newest->num_pictures == 0) return;
  char title[256];
  figures_print(newest, game->player, now, title, sizeof title);
  glfwSetWindowTitle(game->window, title);
  *newest = (struct figures){.since = now};
}

/* Plays until the window closes, or for so many seconds from the first frame on. */
static struct figures play(struct game* game, double seconds) {
  const double began = glfwGetTime();
  struct figures all = {.since = began}, newest = all;
  while (!game->has_failed && !glfwWindowShouldClose(game->window)) {
    glfwPollEvents();
    input_follow_mouse(game);
    const double now = glfwGetTime();
    if (game->water.shown == NULL && now - began < kPatience_s)
      all = (struct figures){.since = now};
    if (seconds > 0.0 && now - all.since >= seconds) break;
    lb_frame* frame = lb_player_poll(game->player, now); /* never waits */
    if (!water_take(&game->water, frame)) game->has_failed = true;
    const double taking_s = glfwGetTime() - now;
    if (!draw(game)) game->has_failed = true;
    glfwSwapBuffers(game->window); /* waits for the screen, unless --no-vsync */
    figures_add(&all, taking_s);
    figures_add(&newest, taking_s);
    show_figures(game, &newest, glfwGetTime());
  }
  return all;
}

/* A picture shows the frame of the levers and the time that were asked for, and no earlier one. */
static bool take_exact_frame(struct game* game, double time_s) {
  lb_frame* frame;
  const lb_status status = lb_player_wait_exact(game->player, time_s, kPatience_s, &frame);
  if (status == LB_OK) return water_take(&game->water, frame);
  fprintf(stderr, "splash: %s: %s\n", lb_status_name(status), lb_last_error());
  return false;
}

/* What `--seconds` and `--screenshot` ask for. */
static bool finish(struct game* game, const struct options* options, const struct figures* all) {
  if (options->seconds > 0.0 && all->num_pictures > 0) {
    char text[256];
    figures_print(all, game->player, glfwGetTime(), text, sizeof text);
    printf("%s\n", text);
  }
  if (options->screenshot == NULL) return true;
  if (options->time_s >= 0.0 && !take_exact_frame(game, options->time_s)) return false;
  if (game->water.shown == NULL) {
    fputs("splash: no frame has come, so there is no picture\n", stderr);
    return false;
  }
  int width, height;
  glfwGetFramebufferSize(game->window, &width, &height);
  return draw(game) && write_png(options->screenshot, width, height);
}

static void close_game(struct game* game) {
  water_close(&game->water);
  levers_close(&game->levers);
  lb_player_free(game->player);
  if (game->window != NULL) glfwDestroyWindow(game->window);
  glfwTerminate();
}

int main(int argc, char** argv) {
  struct options options;
  const enum parsed parsed = parse_options(argc, argv, &options);
  if (parsed != PARSED_OK) return parsed == PARSED_HELP ? EXIT_DONE : EXIT_REFUSED;
  struct game game = {0};
  int result = EXIT_FAILED;
  if (open_player(&options, &game.player) && levers_open(game.player, &game.levers)) {
    if (!levers_set(&game.levers, options.num_levers, options.levers)) {
      result = EXIT_REFUSED;
    } else if (open_scene(&game, &options)) {
      start(&game, &options);
      const struct figures all = play(&game, options.seconds);
      if (!game.has_failed && finish(&game, &options, &all)) result = EXIT_DONE;
    }
  }
  close_game(&game);
  return result;
}
