/* Keys and mouse. */
#pragma once

struct game;

/* Lets the window's callbacks change the game. */
void input_open(struct game* game);
/* The mouse moves the lever that it was pressed on, or else turns the view. Once a picture. */
void input_follow_mouse(struct game* game);
