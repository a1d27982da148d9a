/* What the command line says. */
#pragma once

#include <stdbool.h>

enum { kMaxLeverOptions = 32 };

struct options {
  const char* file;   /* of a family, or ... */
  const char* server; /* ... HOST:PORT, and ... */
  const char* family; /* ... the family's id */
  int width, height;  /* of the window */
  int num_samples;    /* of a pixel */
  bool vsync;
  double time_s;          /* paused there; negative: plays from the beginning */
  double seconds;         /* ends so long after the first frame, with figures; 0: goes on */
  const char* screenshot; /* PNG of the last picture; NULL: none */
  int num_levers;
  const char* levers[kMaxLeverOptions]; /* LEVER=VALUE */
};

enum parsed { PARSED_OK, PARSED_HELP, PARSED_WRONG };

/* Says on standard error what is wrong. `--help` prints the usage. */
enum parsed parse_options(int argc, char** argv, struct options* options);
