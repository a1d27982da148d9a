/* The header by itself, in C99, with all warnings. */
#include "liquidblend/liquidblend.h"

int main(void) {
  lb_player_options options = {0};
  lb_player* player = NULL;
  options.struct_size = sizeof options;
  if (lb_version() < 0) return 1;
  if (lb_player_open(&options, &player) != LB_INVALID_ARGUMENT) return 2;
  return player == NULL && lb_last_error()[0] != '\0' ? 0 : 3;
}
