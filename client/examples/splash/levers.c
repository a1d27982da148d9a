#include "levers.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* The range of parameter p: from the least to the greatest of all animations, which are the source
 * and the targets. It begins at the source. */
static struct lever lever_of_parameter(const lb_family_info* family, size_t p) {
  const double* points = family->points;
  struct lever lever = {family->parameters[p], points[p], points[p], points[p]};
  for (size_t animation = 1; animation <= family->num_targets; ++animation) {
    const double value = points[animation * family->num_parameters + p];
    lever.low = fmin(lever.low, value);
    lever.high = fmax(lever.high, value);
  }
  return lever;
}

/* The weight of a target, "animations/{id}". */
static struct lever lever_of_target(const lb_family_info* family, size_t target) {
  const char* name = family->targets[target];
  const char* slash = strrchr(name, '/');
  return (struct lever){slash == NULL ? name : slash + 1, 0.0, 1.0, 0.0};
}

bool levers_open(lb_player* player, struct levers* levers) {
  lb_family_info family = {.struct_size = sizeof family};
  lb_player_describe(player, &family);
  const bool are_parameters = family.num_parameters > 0;
  const size_t count = are_parameters ? family.num_parameters : family.num_targets;
  *levers =
      (struct levers){.player = player, .are_parameters = are_parameters, .count = (int)count};
  levers->items = calloc(count, sizeof *levers->items);
  levers->parameters = calloc(count, sizeof *levers->parameters);
  levers->weights = calloc(count, sizeof *levers->weights);
  if (!levers->items || !levers->parameters || !levers->weights) {
    fputs("splash: no memory for levers\n", stderr);
    return false;
  }
  for (size_t k = 0; k < count; ++k) {
    levers->items[k] =
        are_parameters ? lever_of_parameter(&family, k) : lever_of_target(&family, k);
  }
  return true;
}

void levers_close(struct levers* levers) {
  free(levers->items);
  free(levers->parameters);
  free(levers->weights);
}

/* The lever of that name or number; -1: none. */
static int find_lever(const struct levers* levers, const char* name, size_t length) {
  for (int k = 0; k < levers->count; ++k) {
    char number[16];
    snprintf(number, sizeof number, "%d", k);
    const char* const names[] = {levers->items[k].name, number};
    for (int n = 0; n < 2; ++n) {
      if (strlen(names[n]) == length && strncmp(names[n], name, length) == 0) return k;
    }
  }
  return -1;
}

static bool set_lever(struct levers* levers, const char* text) {
  const size_t length = strcspn(text, "=");
  const int lever = find_lever(levers, text, length);
  if (lever < 0) {
    fprintf(stderr, "splash: --lever %s: there is no such lever; there are:\n", text);
    for (int k = 0; k < levers->count; ++k) {
      const struct lever* it = &levers->items[k];
      fprintf(stderr, "  %d  %s  %g to %g\n", k, it->name, it->low, it->high);
    }
    return false;
  }
  struct lever* it = &levers->items[lever];
  const char* value = text + length + (text[length] == '=');
  char* end;
  it->value = strtod(value, &end);
  if (end != value && *end == '\0' && it->value >= it->low && it->value <= it->high) return true;
  fprintf(stderr, "splash: --lever %s: the value is not in %g to %g\n", text, it->low, it->high);
  return false;
}

bool levers_set(struct levers* levers, int count, const char* const* texts) {
  for (int k = 0; k < count; ++k) {
    if (!set_lever(levers, texts[k])) return false;
  }
  return levers_send(levers, 0.0);
}

bool levers_move(struct levers* levers, int lever, double share) {
  struct lever* it = &levers->items[lever];
  const double before = it->value;
  it->value = it->low + fmin(fmax(share, 0.0), 1.0) * (it->high - it->low);
  return it->value != before;
}

double lever_share(const struct lever* lever) {
  const double length = lever->high - lever->low;
  return length > 0.0 ? (lever->value - lever->low) / length
                      : 0.0; /* one value of all animations */
}

bool levers_send(const struct levers* levers, double over_s) {
  for (int k = 0; k < levers->count; ++k) {
    levers->parameters[k] = (lb_parameter){levers->items[k].name, levers->items[k].value};
    levers->weights[k] = levers->items[k].value;
  }
  const size_t count = (size_t)levers->count;
  /* The levers span a box. Points of it may lie outside of the family's: extrapolate there. */
  const lb_status status =
      levers->are_parameters
          ? lb_player_set_parameters(levers->player, count, levers->parameters, 1, over_s)
          : lb_player_set_weights(levers->player, count, levers->weights, over_s);
  if (status != LB_OK) {
    fprintf(stderr, "splash: the player refuses: %s: %s\n", lb_status_name(status),
            lb_last_error());
  }
  return status == LB_OK;
}
