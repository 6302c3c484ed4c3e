#include <algorithm>

#include <cmath>
#include <numbers>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <glm/common.hpp>
#include <glm/vec2.hpp>

#include "model/bounding_box.hpp"
#include "model/own_process.hpp"
#include "model/random.hpp"
#include "model/refuse.hpp"
#include "palpate/pose.hpp"
#include "palpate/simulation.hpp"
#include "simulation/spans.hpp"

namespace palpate {

namespace {

constexpr double pitch_mm = 6.8;             ///< of the training grid
constexpr double reach_mm = 1.5 * pitch_mm;  ///< outermost of the 4 positions
constexpr double turn_rad = 2.0 * std::numbers::pi;

/// Radius at which the point spread is cut off, in standard deviations: 6e-7 of it lies beyond.
constexpr double reach = 5.0;

/// A shape's displacement map convolved with a Gaussian point spread: 1 deep inside the shape, 0
/// far from it, on a grid in the object frame.
class DisplacementField {
 public:
  /// @param psf_mm standard deviation of the point spread; 0 leaves the shape sharp
  /// @throws Error on a point that is not finite or more than 1 km from the origin, or a shape
  /// without area
  DisplacementField(const Shape& shape, double psf_mm) {
    const BoundingBox box = bounds_of(shape);
    const glm::dvec2 extent = box.extent() + 2.0 * reach * psf_mm;
    // Cells of 0.1 mm suffice for this sensor. They are larger where a large shape would need more
    // than 2000 x 2000 cells, or where the point spread hides smaller ones.
    cell_mm_ = std::max({0.1, std::max(extent.x, extent.y) / 2000.0, psf_mm / 20.0});
    const double margin_mm = reach * psf_mm + cell_mm_;
    lower_mm_ = box.lower - margin_mm;
    nx_ = static_cast<int>(std::ceil((box.upper.x + margin_mm - lower_mm_.x) / cell_mm_));
    ny_ = static_cast<int>(std::ceil((box.upper.y + margin_mm - lower_mm_.y) / cell_mm_));
    values_.assign(static_cast<std::size_t>(nx_) * ny_, 0.0);
    rasterize(shape);
    if (psf_mm > 0.0) {
      blur(psf_mm);
    }
  }

  /// Returns the field's mean over a square of this edge, centred at the element frame's origin.
  double mean(const Pose& T_object_element, double edge_mm) const {
    // Samples are as fine as the field; the cap bounds the time for an element much larger than the
    // shape.
    const int n = static_cast<int>(std::clamp(std::ceil(edge_mm / cell_mm_), 1.0, 256.0));
    const glm::dvec2 step_x = rotate(T_object_element.theta_rad, {edge_mm / n, 0.0});
    const glm::dvec2 step_y = rotate(T_object_element.theta_rad, {0.0, edge_mm / n});
    double sum = 0.0;
    for (int j = 0; j < n; ++j) {
      for (int i = 0; i < n; ++i) {
        sum += interpolate(T_object_element.translation_mm + (i + 0.5 - n / 2.0) * step_x +
                           (j + 0.5 - n / 2.0) * step_y);
      }
    }
    return sum / (n * n);
  }

 private:
  double& cell(int i, int j) { return values_[static_cast<std::size_t>(j) * nx_ + i]; }
  double cell(int i, int j) const { return values_[static_cast<std::size_t>(j) * nx_ + i]; }
  /// Computes the covered part of every cell: exactly along x, on 8 lines per cell along y.
  void rasterize(const Shape& shape) {
    constexpr int lines = 8;
    for (int line = 0; line < lines * ny_; ++line) {
      const double y_mm = lower_mm_.y + (line + 0.5) / lines * cell_mm_;
      for (const Span& span : spans(shape, y_mm)) {
        const double begin = (span.begin - lower_mm_.x) / cell_mm_;
        const double end = (span.end - lower_mm_.x) / cell_mm_;
        for (int i = static_cast<int>(begin); i < end; ++i) {
          cell(i, line / lines) += (std::min(end, i + 1.0) - std::max(begin, i + 0.0)) / lines;
        }
      }
    }
  }

  void blur(double psf_mm) {
    // Weights are the Gaussian's integrals over the cells, not its values at their centres: these
    // would be wrong where the point spread is narrower than a cell.
    const int radius = static_cast<int>(std::ceil(reach * psf_mm / cell_mm_));
    const double scale = cell_mm_ / (psf_mm * std::numbers::sqrt2);
    std::vector<double> kernel;
    for (int k = -radius; k <= radius; ++k) {
      kernel.push_back((std::erf((k + 0.5) * scale) - std::erf((k - 0.5) * scale)) / 2.0);
    }

    // The shape fills cells of the middle alone: the border's zeros would add nothing.
    const int border = std::max(radius, 1) - 1;
    std::vector<double> row(nx_);
    for (int j = border; j < ny_ - border; ++j) {
      std::fill(row.begin(), row.end(), 0.0);
      for (int k = -radius; k <= radius; ++k) {
        for (int i = std::max(0, border - k); i < std::min(nx_, nx_ - border - k); ++i) {
          row[i] += kernel[k + radius] * cell(i + k, j);
        }
      }
      std::copy(row.begin(), row.end(), &cell(0, j));
    }

    std::vector<double> blurred(values_.size(), 0.0);
    for (int j = 0; j < ny_; ++j) {
      double* out = &blurred[static_cast<std::size_t>(j) * nx_];
      for (int k = std::max(-radius, border - j); k <= std::min(radius, ny_ - border - 1 - j);
           ++k) {
        const double* in = &cell(0, j + k);
        for (int i = 0; i < nx_; ++i) {
          out[i] += kernel[k + radius] * in[i];
        }
      }
    }
    values_ = std::move(blurred);
  }

  /// Interpolates bilinearly between cell centres; 0 beyond the grid, whose border the shape does
  /// not reach.
  double interpolate(const glm::dvec2& p_object_mm) const {
    const glm::dvec2 u = (p_object_mm - lower_mm_) / cell_mm_ - 0.5;
    if (!(u.x >= 0.0 && u.x < nx_ - 1 && u.y >= 0.0 && u.y < ny_ - 1)) {
      return 0.0;
    }
    const int i = static_cast<int>(u.x);
    const int j = static_cast<int>(u.y);
    return glm::mix(glm::mix(cell(i, j), cell(i + 1, j), u.x - i),
                    glm::mix(cell(i, j + 1), cell(i + 1, j + 1), u.x - i), u.y - j);
  }

  double cell_mm_ = 0.1;
  glm::dvec2 lower_mm_{0.0, 0.0};  ///< lower left corner of cell (0, 0)
  int nx_ = 0;
  int ny_ = 0;
  std::vector<double> values_;  ///< [ny, nx]
};

void validate(const SensorModel& model) {
  // The bound is far beyond any sensor and keeps the arithmetic finite.
  constexpr double largest = 1e6;
  struct Field {
    const char* name;
    double value;
    bool may_be_0;
  };
  for (const auto& [name, value, may_be_0] :
       {Field{"psf_mm", model.psf_mm, true}, Field{"element_mm", model.element_mm, false},
        Field{"pressure_kpa", model.pressure_kpa, false},
        Field{"force_spread", model.force_spread, true},
        Field{"gain_spread", model.gain_spread, true}, Field{"noise_kpa", model.noise_kpa, true}}) {
    // Written so that NaN is refused.
    if (!(may_be_0 ? value >= 0.0 : value > 0.0) || value > largest) {
      refuse(fmt::format("sensor {} = {}", name, value), "give a number {} 0, at most {}",
             may_be_0 ? "from" : "above", largest);
    }
  }
}

void validate(const std::vector<glm::dvec2>& elements_mm) {
  if (elements_mm.empty()) {
    refuse("array without elements", "give at least one position in mm");
  }
  for (std::size_t i = 0; i < elements_mm.size(); ++i) {
    const glm::dvec2& p = elements_mm[i];
    if (!std::isfinite(p.x) || !std::isfinite(p.y)) {
      refuse(fmt::format("array element {} at {},{}", i, p.x, p.y), "give finite numbers");
    }
  }
}

/// Draws a factor around 1, at least 0.1: every press has a force, every element a gain.
double random_factor(Random& random, double spread) {
  return std::max(0.1, 1.0 + spread * random.normal());
}

}  // namespace

struct Simulator::Impl {
  std::string label;
  SensorModel model;
  std::vector<glm::dvec2> elements_mm;
  DisplacementField field;
  Random random;
  std::vector<double> gains;  ///< [e]
};

Simulator::Simulator(const Shape& shape, const SensorModel& model,
                     std::vector<glm::dvec2> elements_mm, std::uint64_t seed) {
  validate(model);
  validate(elements_mm);
  impl_ = std::make_unique<Impl>(Impl{.label = shape.label,
                                      .model = model,
                                      .elements_mm = std::move(elements_mm),
                                      .field = DisplacementField(shape, model.psf_mm),
                                      .random = Random(seed, Stream::sensor),
                                      .gains = {}});
  for (std::size_t i = 0; i < impl_->elements_mm.size(); ++i) {
    impl_->gains.push_back(random_factor(impl_->random, model.gain_spread));
  }
}

Simulator::~Simulator() = default;
Simulator::Simulator(Simulator&&) noexcept = default;
Simulator& Simulator::operator=(Simulator&&) noexcept = default;

Recording Simulator::touch(const std::vector<Pose>& T_robot_sensor, const Pose& T_object_robot) {
  Impl& simulator = held_by(impl_, "simulator");
  const SensorModel& model = simulator.model;
  const std::size_t e = simulator.elements_mm.size();
  Recording recording;
  recording.object = simulator.label;
  recording.T_robot_sensor = T_robot_sensor;
  recording.elements_mm = simulator.elements_mm;
  recording.pressure.reserve(T_robot_sensor.size() * e);
  recording.time_s.reserve(T_robot_sensor.size());
  for (const Pose& pose : T_robot_sensor) {
    const Pose T_object_sensor = T_object_robot * pose;
    require_finite(T_object_sensor);
    const double force_kpa =
        model.pressure_kpa * random_factor(simulator.random, model.force_spread);
    for (std::size_t i = 0; i < e; ++i) {
      const Pose T_object_element = T_object_sensor * Pose{simulator.elements_mm[i], 0.0};
      const double pressure_kpa = force_kpa * simulator.gains[i] *
                                      simulator.field.mean(T_object_element, model.element_mm) +
                                  model.noise_kpa * simulator.random.normal();
      recording.pressure.push_back(std::max(0.0, pressure_kpa));
    }
    recording.time_s.push_back(0.5 * static_cast<double>(recording.time_s.size()));
  }
  return recording;
}

std::vector<Pose> training_grid() {
  constexpr int angles = 12;
  std::vector<Pose> poses;
  for (int row = 0; row < 4; ++row) {
    for (int column = 0; column < 4; ++column) {
      for (int angle = 0; angle < angles; ++angle) {
        poses.push_back(
            {{column * pitch_mm - reach_mm, row * pitch_mm - reach_mm}, angle * turn_rad / angles});
      }
    }
  }
  return poses;
}

std::vector<Pose> random_poses(int n, std::uint64_t seed) {
  require(n >= 0, "number of random poses", n, "give zero or more");
  Random random(seed, Stream::touch_poses);
  std::vector<Pose> poses(n);
  for (Pose& pose : poses) {
    // One draw per statement: within a statement the compiler chooses the order of evaluation.
    pose.translation_mm.x = random.uniform(-reach_mm, reach_mm);
    pose.translation_mm.y = random.uniform(-reach_mm, reach_mm);
    pose.theta_rad = random.uniform(0.0, turn_rad);
  }
  return poses;
}

Pose random_object_pose(std::uint64_t seed) {
  Random random(seed, Stream::object_pose);
  Pose T_object_robot;
  T_object_robot.translation_mm.x = random.uniform(-10.0, 10.0);
  T_object_robot.translation_mm.y = random.uniform(-10.0, 10.0);
  T_object_robot.theta_rad = random.uniform(0.0, turn_rad);
  return T_object_robot;
}

}  // namespace palpate
