// The interface of the kernels, included by C++ and GLSL: constants, buffer records and push
// constants. All members are 4-byte scalars, so that C++ and GLSL (std430) lay them out alike.
#ifndef PALPATE_SHADERS_INTERFACE_H
#define PALPATE_SHADERS_INTERFACE_H

#ifdef __cplusplus
#include <cstdint>
namespace palpate::shaders {
using uint = std::uint32_t;
#endif

// Readings, as in palpate::Reading. The numbers between IN_CONTACT and UNKNOWN are In Contact too,
// at higher levels of pressure.
const uint NO_CONTACT = 0;
const uint IN_CONTACT = 1;
const uint UNKNOWN = 8;

// How kernels evaluate the contact model: Eq. 7 as products of likelihood ratios, Eq. 7 in logs
// where float32 cannot hold the products, or a table.
const uint AS_PRODUCTS = 0;
const uint AS_LOGS = 1;
const uint AS_TABLE = 2;

// Width, in cells, of the border of prior around an uploaded map. An index clamped to the border
// finds all four nodes of a tile along an axis at the prior.
const int MAP_BORDER = 4;

// Replaces log(gamma m) if gamma is 0: the likelihood then has no floor.
const float NO_FLOOR = -1e38;

// Likelihoods that are multiplied before one logarithm.
const uint FACTORS_PER_LOG = 8;

// Edge, in cells, of the map tile that one workgroup of accumulate_evidence fills. Smaller tiles
// skip more readings; larger ones copy each reading into fewer lists.
const int TILE_CELLS = 16;

// Texels that a lane of reduce_belief reads before it rescales its sum to a new maximum.
const uint REDUCE_BATCH = 4;

// Log-odds increments 2 atanh(t) are computed by a series for |t| < SERIES_REACH, else by log().
const float SERIES_REACH = 0.2;

// One known element's reading near a tile, relative to the centre of the tile's first cell. Where
// the Gaussian weight is g, the log odds grow by 2 atanh(g gain / (2 + g skew)) (Eq. 4-6).
struct TileReading {
  float x_mm;
  float y_mm;
  float gain;
  float skew;
};

// A tile of the map and its readings, [first, first + count) of the list. The first `near` of them
// lie close to a cell of the tile.
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

// A coordinate, cell + fraction, in units of the map's cell; the split keeps all float32 digits.
struct Split {
  int cell;
  float fraction;  // [0, 1]
};

// An element's position rotated by one theta, in units of the map's cell. Kernels read an ivec4.
struct RotatedElement {
  Split x;
  Split y;
};

// Log odds at four neighbouring nodes of a map. Kernels fetch them at once, as a vec4.
struct Corners {
  float here;
  float right;
  float above;
  float above_right;
};

// Where an object's data begin in the tables of a dispatch.
struct ObjectPlace {
  int first_node;        // of its map
  int map_width;         // in nodes, with border
  int map_height;        // in nodes, with border
  uint first_axis;       // the lattice's x, then y, in cells of its map
  uint first_bin;        // in the slab
  int first_table_node;  // index of its first node in the contact table
};

// Consecutive elements [begin, end) of one reading. Kernels read it as an ivec4.
struct Segment {
  uint begin;
  uint end;
  uint reading;
  uint unused;
};

// A log-likelihood at a node of the contact table, and its rise to the next node. Kernels
// read it as a vec2.
struct TableNode {
  float nats;
  float rise;
};

struct LikelihoodPush {
  uint nx;           // bins along x
  uint row_first;    // the slab's first row, its index along y
  uint rows;         // the slab's number of rows
  uint theta_first;  // the slab's first theta
  uint segments;
  uint elements;      // per theta, in the table of rotated elements
  uint object_first;  // first object of the dispatch, in the table of places
};

// Result of one workgroup of reduce_belief.
struct Partial {
  float max_high;
  float max_low;
  uint arg_max;  // index of the largest bin among the object's bins in the slab
  float sum;     // of exp(log-likelihood - max)
};

struct ReducePush {
  uint bins;           // of one object in the slab
  uint stride;         // from one object's first bin to the next object's; even
  uint partial_first;  // index of the dispatch's first result
};

// What the passes of a blur read of a bin: the log-likelihood of a touch, the difference of a
// belief from its object's largest, or what the pass along y or x has left, see blurred_bin.glsl.
const uint BLUR_TOUCH = 0;
const uint BLUR_BELIEF = 1;
const uint BLUR_ALONG_Y = 2;
const uint BLUR_ALONG_X = 3;

// Bins of a line that an invocation of blur_axis takes; along y, of two lines.
const uint BLUR_STRIP_X = 16;
const uint BLUR_STRIP_Y = 8;

// The bins of a slab that holds whole planes.
struct PlanesPush {
  uint nx;
  uint ny;
  uint thetas;        // of the slab
  uint theta_first;   // of the slab
  uint all_thetas;    // of the lattice
  uint object_first;  // of the slab
  uint stride;        // from one object's first bin to the next object's; even
};

// The slabs that hold the thetas before and after those of the slab.
struct TurnPush {
  PlanesPush slab;
  uint steps;
  uint around;  // 1: theta continues at its first bin after its last
  uint theta_before;
  uint thetas_before;
  uint theta_after;
  uint first_weight;  // index in the table of the planes' maxima
};

// Where a bin's likelihood comes from when theta grows by some steps: the place (x, y) of the
// plane, in bins, moved by whole + fraction + matrix (x, y). Fraction and matrix are two floats
// each: a bin next to the place may have a weight below 1e-7 and yet count more than all others.
// Kernels read four vec4.
struct TurnedPlane {
  float whole_x;
  float whole_y;
  float unused[2];
  float fraction_x;
  float fraction_x_low;
  float fraction_y;
  float fraction_y_low;
  float xx;
  float xx_low;
  float xy;
  float xy_low;
  float yx;
  float yx_low;
  float yy;
  float yy_low;
};

// An array at one theta: its centre, relative to the pivot's place, and the direction of its x
// axis, in the object frame. Kernels read a vec4.
struct ArrayAtTheta {
  float x_mm;
  float y_mm;
  float cosine;
  float sine;
};

// The box around the cells of an object. Kernels read a vec4.
struct ObjectBox {
  float x_mm;  // of its middle
  float y_mm;
  float half_x_mm;
  float half_y_mm;
};

struct OverlapPush {
  PlanesPush slab;
  uint partial_first;
  float first_x_mm;  // of the lattice's first bin
  float first_y_mm;
  float step_x_mm;
  float step_y_mm;
  float half_x_mm;  // of the array
  float half_y_mm;
};

// Result of one workgroup of sum_overlap, over the bins at which the array overlaps the object.
struct OverlapPartial {
  float max;
  float sum;  // of exp(log-likelihood - max)
  uint bins;
};

// Number of headings with tabled cosine and sine. A theta is a heading plus a small remainder.
const uint HEADINGS = 256;

// Particles of one workgroup of sum_weights.
const uint WEIGHT_BLOCK = 1024;

// How draw_particles finds a particle.
const uint DRAW_INITIAL = 0;      // the initial distribution
const uint DRAW_SAME = 1;         // the particle of the same index
const uint DRAW_MULTINOMIAL = 2;  // an independent draw by weight
const uint DRAW_SYSTEMATIC = 3;   // equal steps through the summed weights

// Uses of random numbers. The use is a word of the generator's counter: no two uses share a number.
const uint RANDOM_ANCESTOR = 0;
const uint RANDOM_MOTION = 1;
const uint RANDOM_POSE = 2;
const uint RANDOM_OFFSET = 3;

// One workgroup of sum_cones evaluates the Parzen estimate at PARZEN_EDGE x PARZEN_EDGE x
// PARZEN_THETAS grid points (x, y, theta). A lane takes all x of one (y, theta).
const int PARZEN_EDGE = 4;
const int PARZEN_THETAS = 10;

// A particle; its pose is relative to the region's centre.
struct Particle {
  uint object;
  float x_mm;
  float y_mm;
  float theta_rad;  // [-pi, pi)
};

// One object's share of the initial distribution, summed over this and all objects before it.
struct ObjectShare {
  uint particle_end;  // particles at the start
  uint chance_end;    // probability of a random particle, in units of 2^-32
};

// One block of weights. A key selects the particle to draw: it is the drawn particle's index
// (systematic) or a random word (multinomial). Kernels read it as an ivec4.
struct DrawBlock {
  uint key_end;  // keys in [key_end of the previous block, key_end) fall into this block
  float last;    // systematic: cumulated weight at the block's last key
  float step;    // systematic: cumulated weight between two keys
  float sum;     // of the block's weights
};

struct DrawPush {
  uint key_low;  // of the generator: the seed
  uint key_high;
  uint touch;  // a word of the generator's counter
  uint particles;
  uint draw;      // one of DRAW_
  uint injected;  // probability of a random particle in place of a drawn one, in units of 2^-32
  uint objects;
  uint blocks;      // up to the last block with weight
  float half_x_mm;  // of the region
  float half_y_mm;
  float half_theta_rad;
  float motion_mm;  // standard deviations
  float motion_rad;
};

// One object's map in the table of all maps.
struct ParticleMap {
  int first;  // index of its first cell
  int width;  // with border
  int height;
  uint scale;               // index of the element table with its cell size
  float cells_per_mm_high;  // two floats
  float cells_per_mm_low;
  int first_table_node;  // index of its first node in the contact table
  Split centre_x;        // the region's centre in cells of the bordered map
  Split centre_y;
};

// One known element's position in cells, or one heading's cosine and sine, as coarse + fine. Coarse
// parts have so few bits that products of two are exact. Kernels read it as a vec4.
struct CoarseAndFine {
  float coarse_x;
  float coarse_y;
  float fine_x;
  float fine_y;
};

struct WeighPush {
  uint particles;
  uint segments;
  uint elements;  // per element table (one for each cell size)
  uint fresh;     // 1: the kernel ignores the earlier log-weights
};

// Result of one workgroup of sum_weights. The sums are of weights / the block's largest weight.
struct WeightBlock {
  float max_high;  // the largest log-weight, high + low
  float max_low;
  float sum;
  float sum_squares;
};

// The task of one workgroup of sum_cones: a tile of grid points and ranges of particles near it.
struct ConeUnit {
  int x;  // indices of the tile's first grid point; (0, 0, 0) is the region's centre
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
static_assert(sizeof(RotatedElement) == 16 && sizeof(Segment) == 16 && sizeof(TableNode) == 8);
static_assert(sizeof(Corners) == 16 && sizeof(ObjectPlace) == 24);
static_assert(sizeof(LikelihoodPush) == 28 && sizeof(Partial) == 16);
static_assert(sizeof(ReducePush) == 12);
static_assert(sizeof(TurnPush) == 52 && sizeof(TurnedPlane) == 64);
static_assert(sizeof(ArrayAtTheta) == 16 && sizeof(ObjectBox) == 16);
static_assert(sizeof(OverlapPush) == 56 && sizeof(OverlapPartial) == 12);
static_assert(sizeof(Particle) == 16 && sizeof(ObjectShare) == 8 && sizeof(DrawBlock) == 16);
static_assert(sizeof(DrawPush) == 52 && sizeof(ParticleMap) == 44 && sizeof(CoarseAndFine) == 16);
static_assert(sizeof(WeighPush) == 16 && sizeof(WeightBlock) == 16);
static_assert(sizeof(ConeUnit) == 20 && sizeof(ConePush) == 8);
}  // namespace palpate::shaders
#endif

#endif
