#include "overlay.h"

#include <epoxy/gl.h>
#include <math.h>
#include <stb/stb_easy_font.h>
#include <stdio.h>

#include "gl.h"
#include "levers.h"

enum { kMaxQuads = 16384 }; /* as many as 2 bytes number the corners of */

static const double kEdge = 8.0, kRowHeight = 22.0, kTrack = 150.0; /* in letters' pixels */
static const unsigned char kInk[4] = {24, 34, 46, 255}, kFaint[4] = {24, 34, 46, 90},
                           kBright[4] = {255, 140, 40, 255};

static const char kVertexShader[] =
    "uniform vec2 size;\n"
    "layout(location = 0) in vec2 at;\n"
    "layout(location = 1) in vec4 color;\n"
    "out vec4 shade;\n"
    "void main() {\n"
    "  gl_Position = vec4(2.0 * at.x / size.x - 1.0, 1.0 - 2.0 * at.y / size.y, 0.0, 1.0);\n"
    "  shade = color;\n"
    "}\n";

static const char kFragmentShader[] =
    "in vec4 shade;\n"
    "out vec4 color;\n"
    "void main() { color = shade; }\n";

/* As stb_easy_font has it. Four of them are a rectangle. */
struct corner {
  float x, y, z;
  unsigned char color[4];
};

struct quads {
  struct corner* corners; /* room for kMaxQuads */
  int count;
};

/* Window pixels of a letter's pixel. */
static double scale_of(int height) { return height >= 400 ? 2.0 : 1.0; }

/* Where the track of a lever lies, in letters' pixels. */
struct track {
  double left, right, y;
};

static struct track track_of(const struct levers* levers, int lever, double width, double height) {
  const double row = fmin(kRowHeight, (height - kEdge) / levers->count);
  const struct track track = {kEdge, fmin(kEdge + kTrack, width - kEdge), row * (lever + 1)};
  return track;
}

static void open_indices(void) {
  static const int kTriangles[6] = {0, 1, 2, 0, 2, 3};
  static unsigned short indices[6 * kMaxQuads];
  for (int k = 0; k < 6 * kMaxQuads; ++k) {
    indices[k] = (unsigned short)(k / 6 * 4 + kTriangles[k % 6]);
  }
  glBufferData(GL_ELEMENT_ARRAY_BUFFER, sizeof indices, indices, GL_STATIC_DRAW);
}

bool overlay_open(struct overlay* overlay) {
  overlay->program = make_program("", kVertexShader, kFragmentShader);
  if (!overlay->program) return false;
  glGenVertexArrays(1, &overlay->vertex_array);
  glGenBuffers(1, &overlay->quads);
  glGenBuffers(1, &overlay->indices);
  glBindVertexArray(overlay->vertex_array);
  glBindBuffer(GL_ELEMENT_ARRAY_BUFFER, overlay->indices);
  open_indices();
  glBindBuffer(GL_ARRAY_BUFFER, overlay->quads);
  glBufferData(GL_ARRAY_BUFFER, 4 * kMaxQuads * sizeof(struct corner), NULL, GL_STREAM_DRAW);
  glVertexAttribPointer(0, 2, GL_FLOAT, GL_FALSE, sizeof(struct corner), NULL);
  glVertexAttribPointer(1, 4, GL_UNSIGNED_BYTE, GL_TRUE, sizeof(struct corner),
                        (void*)offsetof(struct corner, color));
  glEnableVertexAttribArray(0);
  glEnableVertexAttribArray(1);
  return gl_is_well("overlay_open");
}

static void add_text(struct quads* quads, double x, double y, const char* text) {
  const int room = (int)sizeof(struct corner) * 4 * (kMaxQuads - quads->count);
  quads->count += stb_easy_font_print((float)x, (float)y, (char*)text, (unsigned char*)kInk,
                                      quads->corners + 4 * quads->count, room);
}

static void add_box(struct quads* quads, double left, double top, double right, double bottom,
                    const unsigned char color[4]) {
  if (quads->count == kMaxQuads) return;
  const double at[4][2] = {{left, top}, {right, top}, {right, bottom}, {left, bottom}};
  struct corner* corners = quads->corners + 4 * quads->count++;
  for (int k = 0; k < 4; ++k) {
    corners[k] = (struct corner){
        (float)at[k][0], (float)at[k][1], 0.0f, {color[0], color[1], color[2], color[3]}};
  }
}

static void add_lever(struct quads* quads, const struct levers* levers, int k, struct track track) {
  const struct lever* lever = &levers->items[k];
  const double handle = track.left + lever_share(lever) * (track.right - track.left);
  char text[128];
  snprintf(text, sizeof text, "%s %.2f", lever->name, lever->value);
  add_text(quads, track.left, track.y - 13.0, text);
  add_box(quads, track.left, track.y - 1.0, track.right, track.y + 1.0, kFaint);
  add_box(quads, handle - 2.0, track.y - 4.0, handle + 2.0, track.y + 4.0,
          k == levers->chosen ? kBright : kInk);
}

void overlay_draw(const struct overlay* overlay, const struct levers* levers, int width,
                  int height) {
  const double scale = scale_of(height), letters_x = width / scale, letters_y = height / scale;
  glBindVertexArray(overlay->vertex_array);
  glBindBuffer(GL_ARRAY_BUFFER, overlay->quads);
  struct quads quads = {glMapBufferRange(GL_ARRAY_BUFFER, 0, 4 * kMaxQuads * sizeof(struct corner),
                                         GL_MAP_WRITE_BIT | GL_MAP_INVALIDATE_BUFFER_BIT),
                        0};
  if (quads.corners == NULL) return; /* which gl_is_well() tells */
  for (int k = 0; k < levers->count; ++k) {
    add_lever(&quads, levers, k, track_of(levers, k, letters_x, letters_y));
  }
  glUnmapBuffer(GL_ARRAY_BUFFER);
  glUseProgram(overlay->program);
  glUniform2f(glGetUniformLocation(overlay->program, "size"), (float)letters_x, (float)letters_y);
  glEnable(GL_BLEND);
  glBlendFunc(GL_SRC_ALPHA, GL_ONE_MINUS_SRC_ALPHA);
  glDrawElements(GL_TRIANGLES, 6 * quads.count, GL_UNSIGNED_SHORT, NULL);
  glDisable(GL_BLEND);
}

int lever_at(const struct levers* levers, int width, int height, double x, double y) {
  const double scale = scale_of(height);
  for (int k = 0; k < levers->count; ++k) {
    const struct track track = track_of(levers, k, width / scale, height / scale);
    const bool is_there = x / scale > track.left - 6.0 && x / scale < track.right + 6.0 &&
                          y / scale > track.y - 13.0 && y / scale < track.y + 7.0;
    if (is_there) return k;
  }
  return -1;
}

double share_at(int width, int height, double x) {
  const double scale = scale_of(height);
  const double right = fmin(kEdge + kTrack, width / scale - kEdge);
  return (x / scale - kEdge) / (right - kEdge);
}
