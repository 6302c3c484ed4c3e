#include "bounded_set_up.hpp"

#include <numeric>

#include "support/touched_shape.hpp"

namespace palpate {

const std::vector<Hypothesis>& two_shapes() {
  static const std::vector<Hypothesis> two{{map_of(on_letter_l, "L"), 1.0},
                                           {map_of(on_disc, "disc"), 2.0}};
  return two;
}

const std::vector<Hypothesis>& two_made_up() {
  static const std::vector<Hypothesis> two{{random_map(31, 27, 0.5, 3.0, 801), 1.0},
                                           {random_map(23, 29, 0.5, 3.0, 802), 3.0}};
  return two;
}

BoundedOptions small_options() {
  return {.lattice = {.x_mm = {-6.0, 6.0, 13},
                      .y_mm = {-5.0, 6.0, 12},
                      .theta_rad = {0, two_pi, 16},
                      .pivot_mm = {2.0, -1.0}}};
}

BoundedOptions uncertain_options() {
  BoundedOptions options = small_options();
  options.touch_sd = {.mm = 1.0, .rad = 0.2};
  return options;
}

Recording touches_of_l(std::size_t touches, std::uint64_t seed) {
  return touches_of(on_letter_l, {{1.3, -0.8}, 0.7}, touches, seed);
}

double sum(std::span<const double> values) {
  return std::accumulate(values.begin(), values.end(), 0.0);
}

HistogramOptions dense_options(const BoundedOptions& options) {
  return {.lattice = options.lattice,
          .contact = options.contact,
          .none_weight = options.none_weight,
          .touch_sd = options.touch_sd};
}

BothFilters::BothFilters(Device& device, const std::vector<Hypothesis>& objects,
                         const BoundedOptions& options)
    : bounded(objects, options), dense(device, objects, dense_options(options)) {}

void BothFilters::update(const Touch& touch) {
  bounded.update(touch);
  dense.update(touch);
}

}  // namespace palpate
