#include "options.h"

#include <getopt.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>

static const char kUsage[] =
    "splash HOST:PORT FAMILY    plays a family of a server\n"
    "splash --file FILE         plays the file of a family, without a server\n"
    "  --size WIDTHxHEIGHT      of the window (960x600)\n"
    "  --samples NUMBER         of a pixel (4); 0 for a slow graphics card\n"
    "  --no-vsync               draws as often as it can\n"
    "  --lever LEVER=VALUE      sets a lever, by its name or number, the first is 0; may be "
    "repeated\n"
    "  --time SECONDS           pauses there\n"
    "  --seconds SECONDS        ends so long after the first frame, and prints figures\n"
    "  --screenshot FILE.png    writes the last picture\n"
    "Keys: left and right move a lever, up and down choose one, space pauses, R restarts, Esc "
    "ends.\n"
    "The mouse moves levers and turns the view, its wheel comes closer.\n"
    "Exit status: 0 done; 1 failed; 2 an argument is refused.\n";

static enum parsed wrong(const char* what, const char* value) {
  fprintf(stderr, "splash: %s: %s\nsplash --help tells the usage\n", what, value);
  return PARSED_WRONG;
}

static bool read_samples(const char* text, int* num_samples) {
  char more;
  return sscanf(text, "%2d%c", num_samples, &more) == 1 && *num_samples >= 0;
}

static bool read_seconds(const char* text, double* seconds) {
  char* end;
  *seconds = strtod(text, &end);
  return end != text && *end == '\0' && isfinite(*seconds) && *seconds >= 0.0;
}

static bool read_size(const char* text, int* width, int* height) {
  char more;
  return sscanf(text, "%5dx%5d%c", width, height, &more) == 2 && *width > 0 && *height > 0;
}

static enum parsed read_option(int option, struct options* options) {
  switch (option) {
    case 'f':
      options->file = optarg;
      return PARSED_OK;
    case 's':
      if (read_size(optarg, &options->width, &options->height)) return PARSED_OK;
      return wrong("--size is not WIDTHxHEIGHT", optarg);
    case 'n':
      if (read_samples(optarg, &options->num_samples)) return PARSED_OK;
      return wrong("--samples is no number from 0 to 99", optarg);
    case 'v':
      options->vsync = false;
      return PARSED_OK;
    case 'l':
      if (options->num_levers == kMaxLeverOptions) return wrong("one --lever too many", optarg);
      options->levers[options->num_levers++] = optarg;
      return PARSED_OK;
    case 't':
      return read_seconds(optarg, &options->time_s)
                 ? PARSED_OK
                 : wrong("--time is no number from 0 on", optarg);
    case 'e':
      return read_seconds(optarg, &options->seconds)
                 ? PARSED_OK
                 : wrong("--seconds is no number from 0 on", optarg);
    case 'p':
      options->screenshot = optarg;
      return PARSED_OK;
    case 'h':
      fputs(kUsage, stdout);
      return PARSED_HELP;
    default: /* getopt_long() has said what is wrong */
      return PARSED_WRONG;
  }
}

enum parsed parse_options(int argc, char** argv, struct options* options) {
  static const struct option kOptions[] = {
      {"file", required_argument, NULL, 'f'},    {"size", required_argument, NULL, 's'},
      {"samples", required_argument, NULL, 'n'}, {"no-vsync", no_argument, NULL, 'v'},
      {"lever", required_argument, NULL, 'l'},   {"time", required_argument, NULL, 't'},
      {"seconds", required_argument, NULL, 'e'}, {"screenshot", required_argument, NULL, 'p'},
      {"help", no_argument, NULL, 'h'},          {NULL, 0, NULL, 0}};
  *options = (struct options){
      .width = 960, .height = 600, .num_samples = 4, .vsync = true, .time_s = -1.0};
  for (int option; (option = getopt_long(argc, argv, "", kOptions, NULL)) != -1;) {
    const enum parsed parsed = read_option(option, options);
    if (parsed != PARSED_OK) return parsed;
  }
  const int num_left = argc - optind;
  if (num_left != (options->file != NULL ? 0 : 2)) {
    return wrong("give either HOST:PORT and FAMILY, or --file", num_left > 0 ? argv[optind] : "");
  }
  if (options->file == NULL) {
    options->server = argv[optind];
    options->family = argv[optind + 1];
  }
  return PARSED_OK;
}
