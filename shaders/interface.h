// What the kernels and the host agree on: constants, buffer records and push constants, of 4-byte
// scalars only, so that C++ and GLSL (std430) lay them out alike.
#ifndef PALPATE_SHADERS_INTERFACE_H
#define PALPATE_SHADERS_INTERFACE_H

#ifdef __cplusplus
#include <cstdint>
namespace palpate::shaders {
using uint = std::uint32_t;
#endif

// Reading classes, as in palpate::Reading. Unknown elements never reach a kernel.
const uint NO_CONTACT = 0;
const uint IN_CONTACT = 1;

// Rows and columns of prior that surround an uploaded map, on each side: two, so that a clamped
// cell index finds both of its nodes at the prior.
const int MAP_BORDER = 2;

// Edge of the square tile of map cells that one workgroup of accumulate_evidence fills.
const int TILE_CELLS = 16;

// Bins that one workgroup of reduce_belief covers.
const uint REDUCE_BINS = 4096;

// One known element's reading near a tile, relative to the centre of the tile's first cell.
struct TileReading {
  float x_mm;
  float y_mm;
  uint reading;
};

// A tile of the map and its readings, [first, first + count) of the list.
struct Tile {
  uint column;
  uint row;
  uint first;
  uint count;
};

struct EvidencePush {
  uint tile_first;  // index of the dispatch's first tile
  uint width;       // cells
  uint height;
  float cell_mm;
};

// A coordinate in units of the map's cell, split so that no float32 digit is lost: cell + fraction.
struct Split {
  int cell;
  float fraction;  // [0, 1]
};

// One element rotated by one theta, in units of the map's cell.
struct RotatedElement {
  Split x;
  Split y;
};

// Consecutive elements [begin, end) of the same reading class.
struct Segment {
  uint begin;
  uint end;
  uint reading;
};

struct LikelihoodPush {
  uint plane_first;  // the slab's first (x, y) index
  uint plane_count;  // its number of (x, y) indices
  uint theta_first;  // its first theta
  uint nx;           // bins along x
  uint segments;
  uint elements;   // per theta in the table
  int map_width;   // with border
  int map_height;  // with border
};

// Result of one workgroup of reduce_belief.
struct Partial {
  float max_high;
  float max_low;
  uint arg_max;  // index within the slab
  float sum;     // of exp(log-likelihood - max)
};

struct ReducePush {
  uint bins;
  uint partial_first;
};

struct MarginalPush {
  uint plane_first;
  uint plane_count;
  uint theta_first;
  uint theta_count;
  float max_high;  // the sums are of exp(log-likelihood - max)
  float max_low;
};

#ifdef __cplusplus
static_assert(sizeof(TileReading) == 12 && sizeof(Tile) == 16 && sizeof(EvidencePush) == 16);
static_assert(sizeof(RotatedElement) == 16 && sizeof(Segment) == 12);
static_assert(sizeof(LikelihoodPush) == 32 && sizeof(Partial) == 16);
static_assert(sizeof(ReducePush) == 8 && sizeof(MarginalPush) == 24);
}  // namespace palpate::shaders
#endif

#endif
