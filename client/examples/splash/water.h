/* Frames of a player in buffers of OpenGL, drawn as water over a tiled floor. */
#pragma once

#include <liquidblend/liquidblend.h>
#include <stdbool.h>

struct camera;

struct water {
  lb_frame* shown; /* the frame that is in the buffers; NULL: none yet */
  unsigned vertex_array, vertices, indices;
  size_t vertices_size, indices_size; /* bytes */
  int num_indices;
  unsigned index_type;
  unsigned backdrop, depth, surface; /* programs, and ... */
  unsigned scene;                    /* ... what they know of the camera */
  unsigned empty_array;
  unsigned thickness, framebuffer; /* how much water each pixel looks through */
  int width, height;               /* of these */
};

/* Attributes that the player's frames need. */
enum { kWaterAttributes = LB_NORMALS };

bool water_open(struct water* water);
void water_close(struct water* water);

/* Takes the frame of a poll; NULL, or the same as before, changes nothing. */
bool water_take(struct water* water, lb_frame* frame);
void water_draw(struct water* water, const struct camera* camera, int width, int height);
