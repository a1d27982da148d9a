/* Levers that set the blend of a player: the parameters of its family, or its weights. */
#pragma once

#include <liquidblend/liquidblend.h>
#include <stdbool.h>

struct lever {
  const char* name; /* belongs to the player */
  double low, high, value;
};

struct levers {
  lb_player* player;
  bool are_parameters;
  int count;
  int chosen; /* that the keys move */
  struct lever* items;
  lb_parameter* parameters; /* what is sent: these, ... */
  double* weights;          /* ... or these */
};

/* Makes the levers of the player's family: all at the source. False if there is no memory. */
bool levers_open(lb_player* player, struct levers* levers);
void levers_close(struct levers* levers);

/* Sets levers by texts "NAME=VALUE" or "NUMBER=VALUE", and the player, at once. False if a text is
 * refused, which is said. */
bool levers_set(struct levers* levers, int count, const char* const* texts);
/* Moves a lever to a share of its range, which is cut to [0, 1]. True if that is a change. */
bool levers_move(struct levers* levers, int lever, double share);
double lever_share(const struct lever* lever);

/* Lets the player come there within so many seconds. False if it refuses, which is said. */
bool levers_send(const struct levers* levers, double over_s);
