#include "learning/press_placement.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <utility>

#include <fmt/format.h>
#include <tbb/parallel_for.h>
#include <glm/geometric.hpp>
#include <glm/mat2x2.hpp>

#include "learning/plane_sums.hpp"
#include "model/bounding_box.hpp"
#include "model/refuse.hpp"
#include "model/touch_evidence.hpp"

namespace palpate {

namespace {

/// Bins that are evaluated at the elements' own places.
constexpr std::size_t evaluated_bins = 8;

/// The contact model with a table. Beyond a layer that a table is over lies the layer's own prior.
ContactModel sound(ContactModel contact, const OccupancyGrid& layer) {
  contact.validate();
  if (contact.table) {
    contact.prior = layer.prior;
  }
  return tabulated(std::move(contact));
}

/// The indices of the largest values, the largest and then the first one first.
std::vector<std::size_t> largest(std::span<const float> values, std::size_t count) {
  std::vector<std::size_t> best;
  for (std::size_t i = 0; i < values.size(); ++i) {
    if (best.size() == count && !(values[i] > values[best.back()])) {
      continue;
    }
    best.resize(std::min(best.size(), count - 1));
    const auto smaller = std::ranges::upper_bound(best, values[i], std::ranges::greater{},
                                                  [&](std::size_t at) { return values[at]; });
    best.insert(smaller, i);
  }
  return best;
}

glm::dmat2 rotation(double theta_rad) {
  const glm::dvec2 along = rotate(theta_rad, {1.0, 0.0});
  return {along, {-along.y, along.x}};
}

}  // namespace

int PressPlacer::Samples::nearest(double mm) const {
  // Truncated, as they begin below all elements.
  return static_cast<int>((mm - (first_mm - 0.5 * step_mm)) / step_mm);
}

PressPlacer::PressPlacer(const Hypothesis& hypothesis, const ContactModel& contact,
                         const PoseLattice& lattice)
    : layer_(hypothesis.compared()),
      contact_(sound(contact, layer_)),
      likelihood_(layer_, contact_),
      lattice_(lattice) {
  lattice_.collapse_fixed().validate();
  require_sound_map(layer_);
}

std::vector<float> PressPlacer::log_likelihoods(std::span<const TouchEvidence> press) {
  const std::vector<Element> elements = elements_of(press);
  double reach_squared = 0.0;
  for (const Element& element : elements) {
    reach_squared = std::max(reach_squared, glm::dot(element.from_pivot_mm, element.from_pivot_mm));
  }
  cover(std::sqrt(reach_squared));
  constexpr auto place = &Element::from_pivot_mm;
  if (!std::ranges::equal(elements, resting_, {}, place, place)) {
    const auto none = [&](Reading) { return &no_contact_; };
    resting_ = elements;
    rest_.assign(static_cast<std::size_t>(lattice_.bins()), 0.0F);
    add(elements, none, rest_);
  }
  std::vector<float> bins = rest_;
  const auto excess = [&contact = contact_excess_, &unknown = unknown_excess_](Reading reading) {
    return reading == Reading::no_contact ? nullptr
           : is_contact(reading)          ? &contact[static_cast<std::size_t>(reading) - 1]
                                          : &unknown;
  };
  add(elements, excess, bins);
  return bins;
}

PressPlacement PressPlacer::place(std::span<const TouchEvidence> press) {
  std::vector<float> bins = log_likelihoods(press);
  PressPlacement found{.log_likelihood = -std::numeric_limits<double>::infinity()};
  std::vector<double> evaluated;
  for (const std::size_t bin : largest(bins, evaluated_bins)) {
    const Pose T_object_robot = lattice_.T_object_robot(static_cast<std::int64_t>(bin));
    evaluated.push_back(log_likelihood(press, T_object_robot));
    if (evaluated.back() > found.log_likelihood) {
      found.log_likelihood = evaluated.back();
      found.T_object_robot = T_object_robot;
    }
    bins[bin] = -std::numeric_limits<float>::infinity();  // counts by what it was evaluated to
  }
  double sum = 0.0;
  const auto count_in = [&](double log_likelihood) {
    constexpr double negligible = -50.0;  // e^-50: a billion such bins are 2e-13 of the sum
    const double below = log_likelihood - found.log_likelihood;
    sum += below > negligible ? std::exp(below) : 0.0;
  };
  std::ranges::for_each(evaluated, count_in);
  std::ranges::for_each(bins, count_in);
  found.log_evidence = found.log_likelihood + std::log(sum / static_cast<double>(bins.size()));
  return found;
}

std::vector<PressPlacer::Element> PressPlacer::elements_of(
    std::span<const TouchEvidence> press) const {
  std::vector<Element> elements;
  for (const TouchEvidence& touch : press) {
    const glm::dmat2 turn = rotation(touch.T_robot_sensor.theta_rad);
    const glm::dvec2 sensor_mm = touch.T_robot_sensor.translation_mm - lattice_.pivot_mm;
    for (std::size_t e = 0; e < touch.readings.size(); ++e) {
      elements.push_back({sensor_mm + turn * touch.elements_mm[e], touch.readings[e]});
    }
  }
  return elements;
}

void PressPlacer::cover(double reach_mm) {
  if (reach_mm <= reach_mm_) {
    return;
  }
  reach_mm_ = reach_mm;
  resting_.clear();
  const auto samples = [&](const Axis& axis) {
    const double step = axis.count > 1 ? axis.step() : layer_.cell_mm;
    const int per_step = std::max(1, static_cast<int>(std::ceil(step / layer_.cell_mm - 1e-9)));
    Samples of{.step_mm = step / per_step, .per_step = per_step};
    // One step more on either side is for rounding.
    of.first_mm = axis.centre(0) - reach_mm - step;
    of.columns = axis.count + 3 + static_cast<int>(std::min(1e9, std::ceil(2.0 * reach_mm / step)));
    return of;
  };
  x_ = samples(lattice_.x_mm);
  y_ = samples(lattice_.y_mm);
  const double count = 1.0 * x_.columns * x_.per_step * y_.columns * y_.per_step;
  if (!(count <= static_cast<double>(most_cells))) {
    throw Error(Fault::input,
                fmt::format("a press reaches {:g} mm from the pivot, {:.3g} samples of a map; move "
                            "its touches near the pivot, or use larger cells",
                            reach_mm, count));
  }
  const std::size_t contacts = contact_.table->levels() - 1;
  no_contact_.assign(static_cast<std::size_t>(count) + sum_lanes, 0.0F);
  unknown_excess_ = no_contact_;
  contact_excess_.assign(contacts, no_contact_);
  std::size_t at = 0;
  for (int y_phase = 0; y_phase < y_.per_step; ++y_phase) {
    for (int x_phase = 0; x_phase < x_.per_step; ++x_phase) {
      for (int row = 0; row < y_.columns; ++row) {
        for (int column = 0; column < x_.columns; ++column, ++at) {
          const double log_odds =
              likelihood_.log_odds({x_.first_mm + x_.step_mm * (column * x_.per_step + x_phase),
                                    y_.first_mm + y_.step_mm * (row * y_.per_step + y_phase)});
          const double none = likelihood_.of(Reading::no_contact, log_odds);
          no_contact_[at] = static_cast<float>(none);
          unknown_excess_[at] = -no_contact_[at];
          for (std::size_t level = 0; level < contacts; ++level) {
            contact_excess_[level][at] =
                static_cast<float>(likelihood_.of(contact_level(level), log_odds) - none);
          }
        }
      }
    }
  }
}

std::size_t PressPlacer::first_sample(const glm::dvec2& turned) const {
  const int u = x_.nearest(lattice_.x_mm.centre(0) + turned.x);
  const int v = y_.nearest(lattice_.y_mm.centre(0) + turned.y);
  const int phase = v % y_.per_step * x_.per_step + u % x_.per_step;
  const int row = phase * y_.columns + v / y_.per_step;
  return static_cast<std::size_t>(row) * static_cast<std::size_t>(x_.columns) +
         static_cast<std::size_t>(u / x_.per_step);
}

template <typename TableOf>
void PressPlacer::add(const std::vector<Element>& elements, const TableOf& table_of,
                      std::vector<float>& bins) const {
  const auto nx = static_cast<std::size_t>(lattice_.x_mm.count);
  const auto ny = static_cast<std::size_t>(lattice_.y_mm.count);
  const std::size_t columns = (nx + sum_lanes - 1) / sum_lanes * sum_lanes;
  tbb::parallel_for(0, lattice_.theta_rad.count, [&](int theta) {
    std::vector<const float*> samples;
    const glm::dmat2 turn = rotation(lattice_.theta_rad.centre(theta));
    for (const Element& element : elements) {
      if (const std::vector<float>* table = table_of(element.reading)) {
        samples.push_back(table->data() + first_sample(turn * element.from_pivot_mm));
      }
    }
    std::vector<float> sums(ny * columns);
    sum_planes(samples, static_cast<std::size_t>(x_.columns), ny, columns, sums.data());
    float* plane = bins.data() + lattice_.plane() * theta;
    for (std::size_t j = 0; j < ny; ++j) {
      for (std::size_t i = 0; i < nx; ++i) {
        plane[j * nx + i] += sums[j * columns + i];
      }
    }
  });
}

PoseLattice placing_lattice(std::span<const TrainingMap> maps, double step_mm, double step_rad) {
  BoundingBox box;
  for (const TrainingMap& map : maps) {
    box.take_in(map.map.centre_mm(0, 0));
    box.take_in(map.map.centre_mm(map.map.nx - 1, map.map.ny - 1));
  }
  const double half_mm = 0.5 * std::min(box.extent().x, box.extent().y);
  const auto axis = [](double lower, double upper, double step) {
    return Axis{lower, upper,
                std::max(1, static_cast<int>(std::ceil((upper - lower) / step - 1e-9)))};
  };
  const glm::dvec2 middle = box.middle();
  return {.x_mm = axis(middle.x - half_mm, middle.x + half_mm, step_mm),
          .y_mm = axis(middle.y - half_mm, middle.y + half_mm, step_mm),
          .theta_rad = axis(0.0, 2.0 * std::numbers::pi, step_rad)};
}

}  // namespace palpate
