// The push constants of one_bin, of 4-byte scalars only, for GLSL and C++ alike.
#ifndef PALPATE_BENCH_ONE_BIN_PUSH_H
#define PALPATE_BENCH_ONE_BIN_PUSH_H

#include "../shaders/interface.h"

#ifdef __cplusplus
namespace palpate::shaders {
#endif

struct OneBinPush {
  uint nx;
  uint ny;
  uint segments;
  uint elements;  // per theta in the table
  int map_width;  // with border
  int map_height;
};

#ifdef __cplusplus
static_assert(sizeof(OneBinPush) == 24);
}  // namespace palpate::shaders
#endif

#endif
