/* The levers on the screen: sliders with names and values. Places are in the window's own
 * coordinates, from its upper left corner, as the mouse has them. */
#pragma once

#include <stdbool.h>

struct levers;

struct overlay {
  unsigned program, vertex_array, quads, indices;
};

bool overlay_open(struct overlay* overlay);
/* Draws them into the whole viewport.  Width, height: of the window. */
void overlay_draw(const struct overlay* overlay, const struct levers* levers, int width,
                  int height);

/* The lever at a place of the window; -1: none. */
int lever_at(const struct levers* levers, int width, int height, double x, double y);
/* Which share of its range a lever has if its handle is at x; below 0 and above 1 beside it. */
double share_at(int width, int height, double x);
