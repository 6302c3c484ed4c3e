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
// What an element says instead of No Contact: its likelihood over that of No Contact.
const uint CONTACT_INSTEAD = 2;
const uint UNKNOWN_INSTEAD = 3;

// Rows and columns of prior that surround an uploaded map, on each side: so many that a clamped
// index finds all four nodes of a tile along an axis at the prior.
const int MAP_BORDER = 4;

// Stands for log(gamma m) where gamma is 0: the likelihood has no floor.
const float NO_FLOOR = -1e38;

// Elements whose likelihoods are multiplied before one logarithm, and before one division.
const uint FACTORS_PER_LOG = 8;
const uint FACTORS_PER_DIVISION = 4;

// Edge of the square tile of map cells that one workgroup of accumulate_evidence fills: small, for
// few readings that reach none of its cells, and large, for few lists that a reading stands in.
const int TILE_CELLS = 16;

// Nats below the largest at which a bin no longer counts: sums of 1e9 such bins are below float32,
// and an exponential that is not denormal, which costs CPUs a hundred times as much, takes its
// place.
const float NEGLIGIBLE = -80.0;

// Texels that a lane of reduce_belief takes at a time, for one new maximum and one rescaling of the
// sum.
const uint REDUCE_BATCH = 4;

// Increments above 2 atanh(SERIES_REACH) take a logarithm, smaller ones a series.
const float SERIES_REACH = 0.2;

// One known element's reading near a tile, relative to the centre of the tile's first cell. The
// log-odds increment at Gaussian weight g is 2 atanh(g gain / (2 + g skew)).
struct TileReading {
  float x_mm;
  float y_mm;
  float gain;
  float skew;
};

// A tile of the map and its readings, [first, first + count) of the list, of which the first `near`
// come close to a cell of the tile.
struct Tile {
  uint column;
  uint row;
  uint first;
  uint near;
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

// One element rotated by one theta, in units of the map's cell. Kernels read it as an ivec4.
struct RotatedElement {
  Split x;
  Split y;
};

// Log odds at a node of a map, at the nodes to its right and above it, and at the one above that to
// its right. Kernels read it as a vec4: one fetch in the place of four.
struct Corners {
  float here;
  float right;
  float above;
  float above_right;
};

// Where an object stands in the tables of a dispatch.
struct ObjectPlace {
  int first_node;  // of its map
  int map_width;   // with border
  int map_height;
  uint first_axis;  // the lattice's x, then y, in cells of its map
  uint first_bin;   // in the slab
};

// Consecutive elements [begin, end) of the same reading class. Kernels read it as an ivec4.
struct Segment {
  uint begin;
  uint end;
  uint reading;
  uint unused;
};

struct LikelihoodPush {
  uint nx;           // bins along x
  uint row_first;    // the slab's first row, its index along y
  uint rows;         // the slab's number of rows
  uint theta_first;  // the slab's first theta
  uint segments;
  uint elements;      // per theta in the table
  uint object_first;  // of the dispatch, in the table of places
};

// Result of one workgroup of reduce_belief.
struct Partial {
  float max_high;
  float max_low;
  uint arg_max;  // index within the object's bins of the slab
  float sum;     // of exp(log-likelihood - max)
};

struct ReducePush {
  uint bins;    // of one object in the slab
  uint stride;  // from one object's bins to the next one's, an even number
  uint partial_first;
};

struct AddPush {
  uint bins;
  uint row;  // bins that one row of workgroups covers
};

struct MarginalPush {
  uint plane;      // (x, y) indices of the slab
  uint thetas;     // of the slab
  uint first_bin;  // of the object in the slab, an even number
  float max_high;  // the sums are of exp(log-likelihood - max)
  float max_low;
};

// Angles to which cosine and sine are tabled; what is left of an angle is small.
const uint HEADINGS = 256;

// Particles that one workgroup of sum_weights covers, a run of them per lane.
const uint WEIGHT_LANES = 64;
const uint WEIGHT_BLOCK = 1024;

// Where draw_particles takes a particle from.
const uint DRAW_INITIAL = 0;      // the initial distribution
const uint DRAW_SAME = 1;         // the particle of the same index
const uint DRAW_MULTINOMIAL = 2;  // an independent draw by weight
const uint DRAW_SYSTEMATIC = 3;   // equal steps through the summed weights

// What a random number is for: a word of its counter, so that no two uses share a number.
const uint RANDOM_ANCESTOR = 0;
const uint RANDOM_MOTION = 1;
const uint RANDOM_POSE = 2;
const uint RANDOM_OFFSET = 3;

// Grid points of the Parzen estimate that one workgroup of sum_cones evaluates: x, y and theta. A
// lane takes all x of one (y, theta).
const int PARZEN_EDGE = 4;
const int PARZEN_THETAS = 10;

// A hypothesis of the particle filter, relative to the region's centre. Kernels read it as an
// ivec4.
struct Particle {
  uint object;
  float x_mm;
  float y_mm;
  float theta_rad;  // [-pi, pi)
};

// One object's part in the initial distribution, as bounds that grow with the object: its particles
// at the start, and 2^-32 of the chance that a random particle is of it.
struct ObjectShare {
  uint particle_end;
  uint chance_end;
};

// What draw_particles has to know of a block of weights. Keys are the particle drawn for
// (systematic) or a random word (multinomial). Kernels read it as an ivec4.
struct DrawBlock {
  uint key_end;  // keys from the block before up to this one fall into the block
  float last;    // systematic: where the last of them falls, as cumulated weight
  float step;    // systematic: between keys
  float sum;     // of the block's weights
};

struct DrawPush {
  uint key_low;  // of the generator: the seed
  uint key_high;
  uint touch;  // word of the counters
  uint particles;
  uint draw;      // one of DRAW_
  uint injected;  // 2^-32 of the chance that a random particle takes the place
  uint objects;
  uint blocks;      // up to the last that weighs anything
  float half_x_mm;  // of the region
  float half_y_mm;
  float half_theta_rad;
  float motion_mm;  // standard deviations
  float motion_rad;
};

// One object's map among all maps, which stand in one table.
struct ParticleMap {
  int first;  // cell
  int width;  // with border
  int height;
  uint scale;               // which of the tables of elements has its cell size
  float cells_per_mm_high;  // two floats
  float cells_per_mm_low;
  Split centre_x;  // the region's centre in cells of the bordered map
  Split centre_y;
};

// One known element in cells, or one heading's cosine and sine: the coarse part has so few bits
// that products of the two are exact. Kernels read it as a vec4.
struct CoarseAndFine {
  float coarse_x;
  float coarse_y;
  float fine_x;
  float fine_y;
};

struct WeighPush {
  uint particles;
  uint segments;
  uint elements;  // per cell size
  uint fresh;     // 1 where the log-weights so far do not count
};

// Result of one workgroup of sum_weights; sums are relative to the block's largest weight.
struct WeightBlock {
  float max_high;  // of the log-weights
  float max_low;
  float sum;
  float sum_squares;
};

// Grid points from this one on, and the ranges of particles that reach them.
struct ConeUnit {
  int x;  // indices of the grid, which goes through the region's centre
  int y;
  int theta;
  uint range_first;
  uint range_end;
};

struct ConePush {
  float step_mm;
  float step_rad;
};

#ifdef __cplusplus
static_assert(sizeof(TileReading) == 16 && sizeof(Tile) == 20 && sizeof(EvidencePush) == 16);
static_assert(sizeof(RotatedElement) == 16 && sizeof(Segment) == 16);
static_assert(sizeof(Corners) == 16 && sizeof(ObjectPlace) == 20);
static_assert(sizeof(LikelihoodPush) == 28 && sizeof(Partial) == 16);
static_assert(sizeof(ReducePush) == 12 && sizeof(AddPush) == 8 && sizeof(MarginalPush) == 20);
static_assert(sizeof(Particle) == 16 && sizeof(ObjectShare) == 8 && sizeof(DrawBlock) == 16);
static_assert(sizeof(DrawPush) == 52 && sizeof(ParticleMap) == 40 && sizeof(CoarseAndFine) == 16);
static_assert(sizeof(WeighPush) == 16 && sizeof(WeightBlock) == 16);
static_assert(sizeof(ConeUnit) == 20 && sizeof(ConePush) == 8);
}  // namespace palpate::shaders
#endif

#endif
