#include "input.h"

#include "game.h"
#define GLFW_INCLUDE_NONE
#include <GLFW/glfw3.h>

static const double kStep = 0.02;     /* of a lever, for a key */
static const double kRadians = 0.006; /* of a turn, for a pixel of the mouse */

static void move_chosen(struct game* game, double step) {
  const int chosen = game->levers.chosen;
  game_move_lever(game, chosen, lever_share(&game->levers.items[chosen]) + step);
}

static void choose(struct levers* levers, int step) {
  levers->chosen = (levers->chosen + levers->count + step) % levers->count;
}

static void on_key(GLFWwindow* window, int key, int code, int action, int modifiers) {
  (void)code, (void)modifiers;
  struct game* game = glfwGetWindowUserPointer(window);
  if (action == GLFW_RELEASE) return;
  if (key == GLFW_KEY_LEFT) move_chosen(game, -kStep);
  if (key == GLFW_KEY_RIGHT) move_chosen(game, kStep);
  if (key == GLFW_KEY_UP) choose(&game->levers, -1);
  if (key == GLFW_KEY_DOWN) choose(&game->levers, 1);
  if (key == GLFW_KEY_SPACE) game_set_playing(game, !game->is_playing);
  if (key == GLFW_KEY_R) {
    game_seek(game, 0.0);
    game_set_playing(game, true);
  }
  if (key == GLFW_KEY_ESCAPE) glfwSetWindowShouldClose(window, GLFW_TRUE);
}

static void on_scroll(GLFWwindow* window, double x, double y) {
  (void)x;
  struct game* game = glfwGetWindowUserPointer(window);
  camera_approach(&game->camera, (float)y);
}

void input_open(struct game* game) {
  game->mouse.held = -1;
  glfwSetWindowUserPointer(game->window, game);
  glfwSetKeyCallback(game->window, on_key);
  glfwSetScrollCallback(game->window, on_scroll);
}

void input_follow_mouse(struct game* game) {
  const struct mouse before = game->mouse;
  struct mouse* mouse = &game->mouse;
  int width, height;
  glfwGetWindowSize(game->window, &width, &height);
  glfwGetCursorPos(game->window, &mouse->x, &mouse->y);
  mouse->is_pressed = glfwGetMouseButton(game->window, GLFW_MOUSE_BUTTON_LEFT) == GLFW_PRESS;
  if (!mouse->is_pressed) {
    mouse->held = -1;
    return;
  }
  if (!before.is_pressed) mouse->held = lever_at(&game->levers, width, height, mouse->x, mouse->y);
  if (mouse->held >= 0) {
    game_move_lever(game, mouse->held, share_at(width, height, mouse->x));
  } else if (before.is_pressed) {
    camera_turn(&game->camera, (float)(kRadians * (before.x - mouse->x)),
                (float)(kRadians * (mouse->y - before.y)));
  }
}
