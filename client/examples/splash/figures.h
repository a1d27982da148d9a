/* Figures of the player, and of the loop that shows its frames. */
#pragma once

#include <liquidblend/liquidblend.h>

/* What was drawn since some time. */
struct figures {
  double since;
  double taking_s; /* for polls, and copies of frames */
  long num_pictures;
};

void figures_add(struct figures* figures, double taking_s);
/* One line, as text. Requires: one picture at least. */
void figures_print(const struct figures* figures, const lb_player* player, double now, char* text,
                   size_t size);
