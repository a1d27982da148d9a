#include "water.h"

#include <epoxy/gl.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>

#include "camera.h"
#include "gl.h"
#include "shaders.h"

/* What is in the vertex buffer, interleaved. */
struct vertex {
  float position[3];
  float normal[3];
};

static void open_buffers(struct water* water) {
  glGenVertexArrays(1, &water->empty_array);
  glGenVertexArrays(1, &water->vertex_array);
  glGenBuffers(1, &water->vertices);
  glGenBuffers(1, &water->indices);
  glBindVertexArray(water->vertex_array);
  glBindBuffer(GL_ARRAY_BUFFER, water->vertices);
  glBindBuffer(GL_ELEMENT_ARRAY_BUFFER, water->indices); /* the vertex array keeps it */
  glVertexAttribPointer(0, 3, GL_FLOAT, GL_FALSE, sizeof(struct vertex),
                        (void*)offsetof(struct vertex, position));
  glVertexAttribPointer(1, 3, GL_FLOAT, GL_FALSE, sizeof(struct vertex),
                        (void*)offsetof(struct vertex, normal));
  glEnableVertexAttribArray(0);
  glEnableVertexAttribArray(1);
}

bool water_open(struct water* water) {
  *water = (struct water){.index_type = GL_UNSIGNED_SHORT};
  water->backdrop = make_program(kSurroundings, kBackdropVertex, kBackdropFragment);
  water->depth = make_program(kSurroundings, kWaterVertex, kDepthFragment);
  water->surface = make_program(kSurroundings, kWaterVertex, kWaterFragment);
  if (!water->backdrop || !water->depth || !water->surface) return false;
  open_buffers(water);
  glGenBuffers(1, &water->scene);
  glGenTextures(1, &water->thickness);
  glGenFramebuffers(1, &water->framebuffer);
  return gl_is_well("water_open");
}

/* The buffer's memory, without what was in it, so that nobody waits for the graphics card. It grows
 * by half as much again as is needed, so that most frames find it large enough. */
static void* map_buffer(GLenum target, size_t needed, size_t* size) {
  if (needed > *size) {
    *size = needed + needed / 2;
    glBufferData(target, (GLsizeiptr)*size, NULL, GL_STREAM_DRAW);
  }
  return glMapBufferRange(target, 0, (GLsizeiptr)needed,
                          GL_MAP_WRITE_BIT | GL_MAP_INVALIDATE_BUFFER_BIT);
}

static void forget(struct water* water) {
  lb_frame_free(water->shown);
  water->shown = NULL;
}

void water_close(struct water* water) { forget(water); }

static bool copy_frame(struct water* water, const lb_frame* frame, const lb_frame_info* info) {
  const bool is_short = info->num_vertices <= UINT16_MAX + 1;
  lb_layout layout = {.struct_size = sizeof layout,
                      .vertices_size = info->num_vertices * sizeof(struct vertex),
                      .stride = sizeof(struct vertex),
                      .position_offset = offsetof(struct vertex, position),
                      .normal_offset = offsetof(struct vertex, normal),
                      .velocity_offset = -1,
                      .rest_offset = -1,
                      .index_bytes = is_short ? 2 : 4};
  layout.indices_size = 3 * (size_t)info->num_triangles * (size_t)layout.index_bytes;
  layout.vertices = map_buffer(GL_ARRAY_BUFFER, layout.vertices_size, &water->vertices_size);
  layout.indices = map_buffer(GL_ELEMENT_ARRAY_BUFFER, layout.indices_size, &water->indices_size);
  if (!layout.vertices || !layout.indices) {
    fputs("splash: OpenGL gives no memory for a frame\n", stderr);
    return false;
  }
  const lb_status status = lb_frame_copy(frame, &layout);
  if (status != LB_OK) fprintf(stderr, "splash: lb_frame_copy: %s\n", lb_last_error());
  const bool are_kept = glUnmapBuffer(GL_ARRAY_BUFFER) & glUnmapBuffer(GL_ELEMENT_ARRAY_BUFFER);
  if (!are_kept) forget(water); /* lost with a change of the screen: the next poll gives it again */
  water->num_indices = are_kept ? (int)(3 * info->num_triangles) : 0;
  water->index_type = is_short ? GL_UNSIGNED_SHORT : GL_UNSIGNED_INT;
  return status == LB_OK && gl_is_well("copy_frame");
}

bool water_take(struct water* water, lb_frame* frame) {
  if (frame == NULL || frame == water->shown) {
    lb_frame_free(frame); /* of this poll */
    return true;
  }
  /* Kept until the next one, so that no other frame can have its address. */
  forget(water);
  water->shown = frame;
  lb_frame_info info = {.struct_size = sizeof info};
  lb_frame_describe(frame, &info);
  water->num_indices = 0;
  if (info.num_triangles == 0) return true;
  glBindVertexArray(water->vertex_array);
  glBindBuffer(GL_ARRAY_BUFFER, water->vertices);
  return copy_frame(water, frame, &info);
}

static void resize_thickness(struct water* water, int width, int height) {
  if (width == water->width && height == water->height) return;
  water->width = width;
  water->height = height;
  glBindTexture(GL_TEXTURE_2D, water->thickness);
  glTexImage2D(GL_TEXTURE_2D, 0, GL_R32F, width, height, 0, GL_RED, GL_FLOAT, NULL);
  glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MIN_FILTER, GL_NEAREST);
  glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MAG_FILTER, GL_NEAREST);
  glBindFramebuffer(GL_FRAMEBUFFER, water->framebuffer);
  glFramebufferTexture2D(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, GL_TEXTURE_2D, water->thickness, 0);
}

/* What all shaders know, as GLSL's std140 lays it out: vectors of three take the place of four. */
struct block {
  float scene_from_world[16], clip_from_scene[16];
  float half_size[4], eye[4], right[4], up[4], forward[4];
};

static void update_scene(const struct water* water, const struct camera* camera, float aspect) {
  const struct view view = camera_view(camera, aspect);
  struct block block = {.half_size = {0}};
  memcpy(block.scene_from_world, camera->scene_from_world, sizeof block.scene_from_world);
  memcpy(block.clip_from_scene, view.clip_from_scene, sizeof block.clip_from_scene);
  memcpy(block.half_size, camera->half, sizeof camera->half);
  memcpy(block.eye, view.eye, sizeof view.eye);
  memcpy(block.right, view.right, sizeof view.right);
  memcpy(block.up, view.up, sizeof view.up);
  memcpy(block.forward, view.forward, sizeof view.forward);
  glBindBufferBase(GL_UNIFORM_BUFFER, 0, water->scene);
  glBufferData(GL_UNIFORM_BUFFER, sizeof block, &block, GL_STREAM_DRAW);
}

/* Into the texture, so that the surface knows how much water lies behind it. */
static void draw_thickness(const struct water* water) {
  glBindFramebuffer(GL_FRAMEBUFFER, water->framebuffer);
  glClearColor(0.0f, 0.0f, 0.0f, 0.0f);
  glClear(GL_COLOR_BUFFER_BIT);
  glEnable(GL_BLEND);
  glBlendFunc(GL_ONE, GL_ONE);
  glBindVertexArray(water->vertex_array);
  glDrawElements(GL_TRIANGLES, water->num_indices, water->index_type, NULL);
  glDisable(GL_BLEND);
  glBindFramebuffer(GL_FRAMEBUFFER, 0);
}

static void draw_surface(const struct water* water) {
  glEnable(GL_DEPTH_TEST);
  glEnable(GL_CULL_FACE);
  glClear(GL_DEPTH_BUFFER_BIT);
  glBindVertexArray(water->vertex_array);
  glDrawElements(GL_TRIANGLES, water->num_indices, water->index_type, NULL);
  glDisable(GL_CULL_FACE);
  glDisable(GL_DEPTH_TEST);
}

void water_draw(struct water* water, const struct camera* camera, int width, int height) {
  update_scene(water, camera, (float)width / (float)height);
  resize_thickness(water, width, height);
  glViewport(0, 0, width, height);
  glUseProgram(water->depth);
  draw_thickness(water);
  glUseProgram(water->backdrop);
  glBindVertexArray(water->empty_array);
  glDrawArrays(GL_TRIANGLES, 0, 3);
  glUseProgram(water->surface);
  draw_surface(water);
}
