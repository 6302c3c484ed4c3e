#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <string>

#include <tbb/parallel_for.h>

#include "learning/contact_learning.hpp"
#include "learning/golden_section.hpp"
#include "model/bounding_box.hpp"
#include "model/element_spacing.hpp"
#include "model/touch_evidence.hpp"

namespace palpate {

namespace {

/// Radius over which the mean pressure is smoothed, in spacings: bridges gaps between elements.
constexpr double smoothing = 0.4;

/// A reading at its place in the object frame.
struct Sample {
  glm::dvec2 place_mm;
  double pressure = 0.0;
  std::size_t touch = 0;
};

/// The readings of an object's touches that touched it.
struct Readings {
  std::vector<Sample> samples;
  std::size_t touches = 0;
};

/// Cells around all samples of an object.
struct Field {
  glm::dvec2 origin_mm{0.0};
  double cell_mm = 1.0;
  int nx = 0;
  int ny = 0;
  std::vector<double> values;  ///< [ny, nx]

  double& at(int i, int j) { return values[static_cast<std::size_t>(j) * nx + i]; }
  double at(int i, int j) const { return values[static_cast<std::size_t>(j) * nx + i]; }
  /// Bilinear; 0 beyond the cells.
  double sample(const glm::dvec2& place_mm) const {
    const glm::dvec2 p = (place_mm - origin_mm) / cell_mm;
    const int i = static_cast<int>(std::floor(p.x));
    const int j = static_cast<int>(std::floor(p.y));
    if (i < 0 || j < 0 || i + 1 >= nx || j + 1 >= ny) {
      return 0.0;
    }
    const double fx = p.x - i;
    const double fy = p.y - j;
    return (1.0 - fy) * ((1.0 - fx) * at(i, j) + fx * at(i + 1, j)) +
           fy * ((1.0 - fx) * at(i, j + 1) + fx * at(i + 1, j + 1));
  }
};

/// Forces of touches under which a field explains their pressures best, [touch].
std::vector<double> forces(const Readings& readings, const std::vector<double>& explained) {
  std::vector<double> products(readings.touches, 0.0);
  std::vector<double> squares(readings.touches, 0.0);
  for (std::size_t i = 0; i < explained.size(); ++i) {
    const Sample& sample = readings.samples[i];
    products[sample.touch] += sample.pressure * explained[i];
    squares[sample.touch] += explained[i] * explained[i];
  }
  for (std::size_t t = 0; t < products.size(); ++t) {
    products[t] = squares[t] > 0.0 ? products[t] / squares[t] : 0.0;
  }
  return products;
}

std::vector<double> sampled(const Readings& readings, const Field& field) {
  std::vector<double> values;
  values.reserve(readings.samples.size());
  for (const Sample& sample : readings.samples) {
    values.push_back(field.sample(sample.place_mm));
  }
  return values;
}

/// Mean of the pressures relative to their touches' forces, smoothed over half a spacing.
Field mean_field(const Readings& readings, const std::vector<double>& force, Field field,
                 double spacing_mm) {
  const double deviation = smoothing * spacing_mm;
  const int reach = static_cast<int>(std::ceil(3.0 * deviation / field.cell_mm));
  std::vector<double> weights(field.values.size(), 1e-12);
  std::vector<double> along_x;
  std::ranges::fill(field.values, 0.0);
  for (const Sample& sample : readings.samples) {
    const double f = force[sample.touch];
    if (!(f > 0.0)) {
      continue;
    }
    const glm::dvec2 p = (sample.place_mm - field.origin_mm) / field.cell_mm;
    const int left = std::max(0, static_cast<int>(std::lround(p.x)) - reach);
    const int right = std::min(field.nx - 1, static_cast<int>(std::lround(p.x)) + reach);
    const int bottom = std::max(0, static_cast<int>(std::lround(p.y)) - reach);
    const int top = std::min(field.ny - 1, static_cast<int>(std::lround(p.y)) + reach);
    const auto gaussian = [&](double cells) {
      const double d = cells * field.cell_mm / deviation;
      return std::exp(-0.5 * d * d);
    };
    along_x.clear();
    for (int i = left; i <= right; ++i) {
      along_x.push_back(gaussian(i - p.x));
    }
    for (int j = bottom; j <= top; ++j) {
      // Strong touches say more about the face: their noise is a smaller share.
      const double along_y = f * f * gaussian(j - p.y);
      for (int i = left; i <= right; ++i) {
        const double w = along_y * along_x[static_cast<std::size_t>(i - left)];
        field.at(i, j) += w * sample.pressure / f;
        weights[static_cast<std::size_t>(j) * field.nx + i] += w;
      }
    }
  }
  for (std::size_t k = 0; k < weights.size(); ++k) {
    field.values[k] /= weights[k];
  }
  return field;
}

/// Mean pressure relative to its plateau.
Field relative_pressure(const Readings& readings, double spacing_mm) {
  constexpr double cells_per_spacing = 8.0;
  constexpr double plateau_quantile = 0.9;  // among the cells above half of the largest
  BoundingBox box;
  for (const Sample& sample : readings.samples) {
    box.take_in(sample.place_mm);
  }
  Field field{.cell_mm = spacing_mm / cells_per_spacing};
  const double margin = 4.0 * spacing_mm;
  field.origin_mm = box.lower - margin;
  const glm::dvec2 count = glm::ceil((box.extent() + 2.0 * margin) / field.cell_mm) + 1.0;
  field.nx = static_cast<int>(count.x);
  field.ny = static_cast<int>(count.y);
  field.values.assign(static_cast<std::size_t>(field.nx) * field.ny, 0.0);

  std::vector<double> force(readings.touches, 0.0);
  for (const Sample& sample : readings.samples) {
    force[sample.touch] = std::max(force[sample.touch], sample.pressure);
  }
  constexpr int rounds = 3;
  for (int round = 0; round < rounds; ++round) {
    field = mean_field(readings, force, std::move(field), spacing_mm);
    force = forces(readings, sampled(readings, field));
  }
  const double largest = *std::ranges::max_element(field.values);
  std::vector<double> high;
  std::ranges::copy_if(field.values, std::back_inserter(high),
                       [&](double value) { return value > 0.5 * largest; });
  std::ranges::sort(high);
  const double plateau =
      high.empty()
          ? largest
          : high[static_cast<std::size_t>(plateau_quantile * static_cast<double>(high.size() - 1))];
  for (double& value : field.values) {
    value /= plateau;
  }
  return field;
}

/// A face, 1 or 0, blurred along both axes by a Gaussian and the mean over an element.
Field blurred(const Field& face, double sigma_mm, double edge_mm) {
  const double root = std::sqrt(2.0) * sigma_mm;
  const auto weight = [&](double d) {
    return std::erf((d + edge_mm / 2.0) / root) - std::erf((d - edge_mm / 2.0) / root);
  };
  const int reach = static_cast<int>(std::ceil((4.0 * sigma_mm + edge_mm / 2.0) / face.cell_mm));
  std::vector<double> kernel;  // symmetric
  double sum = 0.0;
  for (int k = -reach; k <= reach; ++k) {
    kernel.push_back(weight(k * face.cell_mm));
    sum += kernel.back();
  }
  const double* middle = kernel.data() + reach;
  // Row by row: the cells of the innermost loop lie side by side.
  const auto add = [](double factor, const double* from, double* to, int cells) {
    for (int i = 0; i < cells; ++i) {
      to[i] += factor * from[i];
    }
  };
  const auto row = [&](auto& of, int j) {
    return of.values.data() + static_cast<std::size_t>(j) * of.nx;
  };
  Field along = face;
  Field result = face;
  std::ranges::fill(along.values, 0.0);
  std::ranges::fill(result.values, 0.0);
  // Most cells are beside the face, and cells of 0 add nothing. The columns that the face reaches:
  int first = face.nx;
  int end = 0;
  std::vector<int> rows;
  for (int j = 0; j < face.ny; ++j) {
    bool on_face = false;
    for (int i = 0; i < face.nx; ++i) {
      if (face.at(i, j) > 0.0) {
        const int from = std::max(0, i - reach);
        const int to = std::min(face.nx, i + reach + 1);
        add(face.at(i, j), middle + (from - i), row(along, j) + from, to - from);
        first = std::min(first, from);
        end = std::max(end, to);
        on_face = true;
      }
    }
    if (on_face) {
      rows.push_back(j);
    }
  }
  for (double& value : along.values) {
    value /= sum;
  }
  // In strips of columns, whose sums stay in registers; the margin is wider than a strip.
  constexpr int strip = 8;
  for (int column = first; column < end; column += strip) {
    const int left = std::min(column, face.nx - strip);
    for (int j = 0; j < face.ny; ++j) {
      std::array<double, strip> sums{};
      const auto below = std::ranges::lower_bound(rows, j - reach);
      for (auto from = below; from != rows.end() && *from <= j + reach; ++from) {
        const double factor = middle[*from - j];
        const double* cells = row(along, *from) + left;
        for (std::size_t i = 0; i < strip; ++i) {
          sums[i] += factor * cells[i];
        }
      }
      std::ranges::transform(sums, row(result, j) + left,
                             [&](double value) { return value / sum; });
    }
  }
  return result;
}

/// The face, 1 or 0, that blurred by a point spread resembles the mean pressure most: begins where
/// the pressure exceeds half of the plateau, and moves its edges by what the blurred face lacks.
Field face_of(const Field& pressure, double sigma_mm, double edge_mm, double spacing_mm) {
  constexpr int rounds = 8;
  const double smoothed_mm = std::hypot(sigma_mm, smoothing * spacing_mm);
  Field level = pressure;
  Field face = pressure;
  for (int round = 0; round < rounds; ++round) {
    for (std::size_t k = 0; k < face.values.size(); ++k) {
      face.values[k] = level.values[k] > 0.5 ? 1.0 : 0.0;
    }
    const Field explained = blurred(face, smoothed_mm, edge_mm);
    double product = 0.0;
    double square = 1e-12;
    for (std::size_t k = 0; k < face.values.size(); ++k) {
      product += pressure.values[k] * explained.values[k];
      square += explained.values[k] * explained.values[k];
    }
    const double scale = std::max(1e-3, product / square);
    for (std::size_t k = 0; k < face.values.size(); ++k) {
      level.values[k] += 0.5 * (pressure.values[k] / scale - explained.values[k]);
    }
  }
  return face;
}

double squared_error(const Readings& readings, const Field& field) {
  const std::vector<double> explained = sampled(readings, field);
  const std::vector<double> force = forces(readings, explained);
  double sum = 0.0;
  for (std::size_t i = 0; i < explained.size(); ++i) {
    const Sample& sample = readings.samples[i];
    const double error = sample.pressure - force[sample.touch] * explained[i];
    sum += error * error;
  }
  return sum;
}

/// The readings of touches with contact, by object, and the largest element spacing.
std::map<std::string, Readings> readings_of(const std::vector<Press>& presses,
                                            const ContactClassifier& classifier,
                                            double& spacing_mm) {
  std::map<std::string, Readings> objects;
  for (const Press& press : presses) {
    for (const Touch& touch : press.touches) {
      const TouchEvidence evidence(touch, {.classifier = classifier});
      const auto spacing = spacing_of(touch.elements_mm);
      if (!spacing || !evidence.in_contact()) {
        continue;
      }
      spacing_mm = std::max(spacing_mm, spacing->nearest_mm.most);
      Readings& own = objects[press.label];
      const Pose T_object_sensor = *press.T_object_robot * touch.T_robot_sensor;
      for (std::size_t e = 0; e < evidence.lives.size(); ++e) {
        if (evidence.lives[e] != 0) {
          own.samples.push_back(
              {T_object_sensor * touch.elements_mm[e], touch.pressure[e], own.touches});
        }
      }
      ++own.touches;
    }
  }
  return objects;
}

}  // namespace

std::optional<double> learn_point_spread(const std::vector<Press>& presses,
                                         const ContactClassifier& classifier) {
  constexpr std::size_t fewest_touches = 10;  // fewer touches of an object leave gaps
  constexpr double of_spacing = 0.95;
  double spacing_mm = 0.0;
  std::vector<Readings> objects;
  std::vector<Field> pressures;
  for (auto& [label, own] : readings_of(presses, classifier, spacing_mm)) {
    if (own.touches >= fewest_touches) {
      objects.push_back(std::move(own));
    }
  }
  if (objects.empty()) {
    return {};
  }
  for (const Readings& object : objects) {
    pressures.push_back(relative_pressure(object, spacing_mm));
  }
  const double edge_mm = of_spacing * spacing_mm;
  const auto error_at = [&](double sigma_mm) {
    std::vector<double> errors(objects.size());
    tbb::parallel_for(std::size_t{0}, objects.size(), [&](std::size_t i) {
      const Field face = face_of(pressures[i], sigma_mm, edge_mm, spacing_mm);
      errors[i] = squared_error(objects[i], blurred(face, sigma_mm, edge_mm));
    });
    double sum = 0.0;
    for (const double of_object : errors) {
      sum += of_object;
    }
    return sum;
  };
  // The search is along the spread's logarithm.
  constexpr double least = 0.05;  // in spacings
  constexpr double most = 3.0;
  constexpr double tolerance = 0.005;
  const double lowest = std::log(least * spacing_mm);
  const double highest = std::log(most * spacing_mm);
  const auto error = [&](double log_sigma) { return error_at(std::exp(log_sigma)); };
  // The face's edges move from cell to cell, so that the error has minima besides the least one.
  constexpr int steps = 10;
  const double step = (highest - lowest) / steps;
  int best = 0;
  double smallest = error(lowest);
  for (int i = 1; i <= steps; ++i) {
    if (const double here = error(lowest + i * step); here < smallest) {
      smallest = here;
      best = i;
    }
  }
  if (best == 0 || best == steps) {
    return {};
  }
  const double found =
      least_at(lowest + (best - 1) * step, lowest + (best + 1) * step, tolerance, error);
  return std::exp(found);
}

}  // namespace palpate
