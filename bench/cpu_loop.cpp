#include "baselines.hpp"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <span>
#include <thread>
#include <vector>

#include "estimation/kernel_inputs.hpp"

namespace palpate::bench {

namespace {

constexpr std::size_t longest_run = 64;  // summed in one float, as in the product
// Eight likelihoods of at least the floor's size multiply within float32: one logarithm for all.
constexpr std::uint32_t factors_per_log = 8;
constexpr float clamp_nats = 20.0F;  // beyond it the likelihood is flat to one part in 1e7

/// One row of bins and the nodes below it. Plain arrays, for the compiler to vectorise over.
struct Row {
  explicit Row(int bins, int map_width)
      : cell(bins), fraction(bins), product(bins), part(bins), nodes(map_width) {}

  std::vector<int> cell;
  std::vector<float> fraction;
  std::vector<float> product;
  std::vector<float> part;
  std::vector<float> nodes;  ///< of the map, between the two rows that an element lies between
};

/// Multiplies the likelihood of one element into every bin's product (Eq. 7).
void multiply(Row& row, const BorderedMap& map, const shaders::Split& bin_y,
              const shaders::RotatedElement& element, float sign, float random_floor,
              float trusted_floor) {
  const int bins = static_cast<int>(row.cell.size());
  const float y = bin_y.fraction + element.y.fraction;
  const float whole_y = std::floor(y);
  const float fy = y - whole_y;
  const int j =
      std::clamp(bin_y.cell + element.y.cell + static_cast<int>(whole_y), 0, map.height - 2);
  // All bins of the row share the position along y, so the two rows of nodes blend into one first;
  // the largest fractions add up to less than 2.
  const int last = map.width - 2;
  const int first_node = std::clamp(row.cell.front() + element.x.cell, 0, last);
  const int end_node = std::clamp(row.cell.back() + element.x.cell + 1, 0, last) + 2;
  const float* const lower = map.log_odds.data() + static_cast<std::ptrdiff_t>(j) * map.width;
  const float* const upper = lower + map.width;
  float* const nodes = row.nodes.data();
#pragma omp simd
  for (int i = first_node; i < end_node; ++i) {
    nodes[i] = sign * (lower[i] + (upper[i] - lower[i]) * fy);
  }

  const int* const cell = row.cell.data();
  const float* const fraction = row.fraction.data();
  float* const product = row.product.data();
  const int shift = element.x.cell;
  const float offset = element.x.fraction;
#pragma omp simd
  for (int i = 0; i < bins; ++i) {
    const float x = fraction[i] + offset;
    const int carry = x >= 1.0F ? 1 : 0;
    const float fx = x - static_cast<float>(carry);
    const int node = std::min(std::max(cell[i] + shift + carry, 0), last);
    const float log_odds = nodes[node] + (nodes[node + 1] - nodes[node]) * fx;
    const float odds = std::exp(std::min(std::max(log_odds, -clamp_nats), clamp_nats));
    product[i] *= (random_floor + trusted_floor * odds) / (1.0F + odds);
  }
}

}  // namespace

CpuLoop::CpuLoop(std::span<const Hypothesis> hypotheses, const PoseLattice& lattice,
                 const ContactModel& model)
    : lattice_(lattice),
      random_floor_(static_cast<float>(model.gamma * *model.prior)),
      trust_(static_cast<float>(1.0 - model.gamma)),
      belief_(hypotheses.size(),
              std::vector<double>(static_cast<std::size_t>(lattice.bins()), 0.0)) {
  for (const Hypothesis& hypothesis : hypotheses) {
    const OccupancyGrid& map = hypothesis.map;
    maps_.push_back({.cell_mm = map.cell_mm,
                     .width = map.nx + 2 * shaders::MAP_BORDER,
                     .height = map.ny + 2 * shaders::MAP_BORDER,
                     .log_odds = with_border(map, *model.prior),
                     .axes = axes_in_cells(map, lattice)});
  }
}

void CpuLoop::update(std::span<const Touch> touches) {
  const KnownElements known =
      gathered(evidence_of(touches, ContactModel{}), lattice_.pivot_mm, longest_run);
  const std::size_t elements = known.from_pivot_mm.size();
  const std::vector<shaders::RotatedElement> rotated =
      rotated_elements(known.from_pivot_mm, lattice_.theta_rad, maps_.front().cell_mm);
  const std::int64_t rows = std::int64_t{lattice_.theta_rad.count} * lattice_.y_mm.count;
  std::atomic<std::int64_t> next = 0;
  const auto work = [&] {
    for (std::int64_t i = next++; i < rows * static_cast<std::int64_t>(maps_.size()); i = next++) {
      const std::int64_t row = i % rows;
      add_row(static_cast<std::size_t>(i / rows), row, known.runs,
              rotated.data() + static_cast<std::size_t>(row / lattice_.y_mm.count) * elements);
    }
  };
  std::vector<std::jthread> threads;
  for (unsigned i = 1; i < std::thread::hardware_concurrency(); ++i) {
    threads.emplace_back(work);
  }
  work();
}

void CpuLoop::add_row(std::size_t object, std::int64_t row, std::span<const ReadingRun> runs,
                      const shaders::RotatedElement* rotated) {
  const int nx = lattice_.x_mm.count;
  const BorderedMap& map = maps_[object];
  Row bins(nx, map.width);
  for (int i = 0; i < nx; ++i) {
    bins.cell[i] = map.axes[i].cell;
    bins.fraction[i] = map.axes[i].fraction;
  }
  const shaders::Split& bin_y = map.axes[nx + row % lattice_.y_mm.count];
  double* const belief = belief_[object].data() + row * nx;
  float* const part = bins.part.data();
  float* const product = bins.product.data();

  for (const ReadingRun& run : runs) {
    const float sign = run.reading == Reading::in_contact ? 1.0F : -1.0F;
    std::fill(bins.part.begin(), bins.part.end(), 0.0F);
    for (std::size_t group = run.begin; group < run.end; group += factors_per_log) {
      std::fill(bins.product.begin(), bins.product.end(), 1.0F);
      const std::size_t end = std::min(group + factors_per_log, run.end);
      for (std::size_t k = group; k < end; ++k) {
        multiply(bins, map, bin_y, rotated[k], sign, random_floor_, random_floor_ + trust_);
      }
#pragma omp simd
      for (int i = 0; i < nx; ++i) {
        part[i] += std::log(product[i]);
      }
    }
#pragma omp simd
    for (int i = 0; i < nx; ++i) {
      belief[i] += static_cast<double>(part[i]);
    }
  }
}

}  // namespace palpate::bench
