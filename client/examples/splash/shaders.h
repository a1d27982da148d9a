/* GLSL of the water. */
#pragma once

extern const char kSurroundings[];
extern const char kBackdropVertex[], kBackdropFragment[];
extern const char kWaterVertex[], kDepthFragment[], kWaterFragment[];
