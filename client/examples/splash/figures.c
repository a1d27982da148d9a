#include "figures.h"

#include <stdio.h>

void figures_add(struct figures* figures, double taking_s) {
  ++figures->num_pictures;
  figures->taking_s += taking_s;
}

void figures_print(const struct figures* figures, const lb_player* player, double now, char* text,
                   size_t size) {
  lb_player_info info = {.struct_size = sizeof info};
  lb_player_statistics(player, &info);
  const double pictures = (double)figures->num_pictures;
  snprintf(text, size,
           "%.1f pictures/s, poll and copy %.2f ms, frames: %lld shown, %lld missed, "
           "wait %.1f ms, decode %.1f ms, %s",
           pictures / (now - figures->since), 1e3 * figures->taking_s / pictures,
           (long long)info.num_shown, (long long)info.num_missed, info.wait_ms, info.decode_ms,
           lb_status_name(info.status));
}
