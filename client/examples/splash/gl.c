#include "gl.h"

#include <epoxy/gl.h>
#include <stdio.h>
#include <stdlib.h>
#define GLFW_INCLUDE_NONE
#include <GLFW/glfw3.h>
#define STB_IMAGE_WRITE_IMPLEMENTATION
#define STB_IMAGE_WRITE_STATIC
#include <stb/stb_image_write.h>

static void say_error(int code, const char* text) {
  fprintf(stderr, "splash: GLFW error 0x%x: %s\n", (unsigned)code, text);
}

GLFWwindow* open_window(int width, int height, int num_samples, bool vsync) {
  glfwSetErrorCallback(say_error);
  if (!glfwInit()) return NULL;
  glfwWindowHint(GLFW_CONTEXT_VERSION_MAJOR, 3);
  glfwWindowHint(GLFW_CONTEXT_VERSION_MINOR, 3);
  glfwWindowHint(GLFW_OPENGL_PROFILE, GLFW_OPENGL_CORE_PROFILE);
  glfwWindowHint(GLFW_OPENGL_FORWARD_COMPAT, GLFW_TRUE);
  glfwWindowHint(GLFW_SAMPLES, num_samples);
  GLFWwindow* window = glfwCreateWindow(width, height, "splash", NULL, NULL);
  if (window == NULL) return NULL;
  glfwMakeContextCurrent(window);
  glfwSwapInterval(vsync ? 1 : 0);
  return window;
}

static GLuint compile(GLenum kind, const char* common, const char* source) {
  const char* const parts[] = {"#version 330 core\n", common, source};
  const GLuint shader = glCreateShader(kind);
  glShaderSource(shader, 3, parts, NULL);
  glCompileShader(shader);
  GLint compiled;
  glGetShaderiv(shader, GL_COMPILE_STATUS, &compiled);
  if (compiled) return shader;
  char log[1024] = "";
  glGetShaderInfoLog(shader, sizeof log, NULL, log);
  fprintf(stderr, "splash: a shader does not compile: %s\n", log);
  glDeleteShader(shader);
  return 0;
}

unsigned make_program(const char* common, const char* vertex, const char* fragment) {
  const GLuint shaders[] = {compile(GL_VERTEX_SHADER, common, vertex),
                            compile(GL_FRAGMENT_SHADER, common, fragment)};
  if (!shaders[0] || !shaders[1]) return 0;
  const GLuint program = glCreateProgram();
  for (int k = 0; k < 2; ++k) {
    glAttachShader(program, shaders[k]);
    glDeleteShader(shaders[k]); /* when the program goes */
  }
  glLinkProgram(program);
  GLint linked;
  glGetProgramiv(program, GL_LINK_STATUS, &linked);
  if (linked) return program;
  char log[1024] = "";
  glGetProgramInfoLog(program, sizeof log, NULL, log);
  fprintf(stderr, "splash: shaders do not link: %s\n", log);
  return 0;
}

bool gl_is_well(const char* where) {
  const GLenum error = glGetError();
  if (error == GL_NO_ERROR) return true;
  fprintf(stderr, "splash: OpenGL error 0x%x in %s\n", error, where);
  return false;
}

bool write_png(const char* path, int width, int height) {
  unsigned char* pixels = malloc((size_t)width * (size_t)height * 3);
  if (pixels == NULL) return false;
  glPixelStorei(GL_PACK_ALIGNMENT, 1);
  glReadPixels(0, 0, width, height, GL_RGB, GL_UNSIGNED_BYTE, pixels);
  stbi_flip_vertically_on_write(1);
  const bool is_written = stbi_write_png(path, width, height, 3, pixels, 3 * width) != 0;
  free(pixels);
  if (!is_written) fprintf(stderr, "splash: cannot write %s\n", path);
  return is_written;
}
