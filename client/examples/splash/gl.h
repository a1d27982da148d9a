/* What every program with OpenGL needs: a window, shaders, errors, pictures. */
#pragma once

#include <stdbool.h>

typedef struct GLFWwindow GLFWwindow;

/* A window with OpenGL 3.3. NULL if there is none, which is said.
 *   num_samples  of a pixel; 0: none but itself
 *   vsync        whether glfwSwapBuffers() waits for the screen */
GLFWwindow* open_window(int width, int height, int num_samples, bool vsync);

/* A program of two shaders; both begin with `common`. 0 if it does not compile, which is said. */
unsigned make_program(const char* common, const char* vertex, const char* fragment);

/* False if OpenGL has failed since the last call, which is said. */
bool gl_is_well(const char* where);

/* Writes what is drawn as PNG. */
bool write_png(const char* path, int width, int height);
