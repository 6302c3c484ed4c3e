#include "learning/setup_judge.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <utility>
#include <vector>

#include <tbb/enumerable_thread_specific.h>
#include <tbb/parallel_for.h>
#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include "learning/local_search.hpp"

namespace palpate {

namespace {

constexpr double farthest_mount_mm = 60.0;
constexpr std::size_t most_touches = 60;  // of an object
constexpr std::size_t most_objects = 4;
constexpr std::size_t most_elements = 64;

/// Touches of one object.
struct Presses {
  std::vector<Pose> poses;
  std::vector<std::vector<std::uint8_t>> contact;  ///< [touch][e] of the elements that count
  glm::dvec2 middle_mm{0.0};
  double span_mm = 0.0;  ///< of the poses about the middle
};

/// Contacts and all readings in each square of a lattice.
class Squares {
 public:
  void begin(std::size_t side) {
    side_ = side;
    counts_.resize(std::max(counts_.size(), side * side));
  }
  void add(std::size_t x, std::size_t y, bool contact) {
    auto& [contacts, all] = counts_[y * side_ + x];
    if (all == 0) {
      used_.push_back(y * side_ + x);
    }
    ++all;
    contacts += contact ? 1 : 0;
  }
  std::size_t side() const { return side_; }
  /// Log-evidence of what was added, which is forgotten.
  double take(const std::vector<double>& log_gamma_half, const std::vector<double>& log_factorial) {
    double sum = 0.0;
    for (const std::size_t k : used_) {
      auto& [contacts, all] = counts_[k];
      sum += log_gamma_half[contacts] + log_gamma_half[all - contacts] - log_factorial[all];
      counts_[k] = {};
    }
    used_.clear();
    return sum;
  }

 private:
  std::size_t side_ = 0;
  std::vector<std::pair<std::uint32_t, std::uint32_t>> counts_;
  std::vector<std::size_t> used_;
};

class MountSearch {
 public:
  MountSearch(const SetupJudge& judge, const Setup& setup)
      : middle_mm_(array_centre_mm(setup.elements_mm)) {
    const std::size_t every_element =
        (setup.elements_mm.size() + most_elements - 1) / most_elements;
    for (std::size_t e = 0; e < setup.elements_mm.size(); e += every_element) {
      elements_mm_.push_back(setup.elements_mm[e] - middle_mm_);
      reach_mm_ = std::max(reach_mm_, glm::length(elements_mm_.back()));
    }
    for (const auto& [object, touches] : judge.touches()) {
      if (objects_.size() == most_objects) {
        break;
      }
      Presses& presses = objects_.emplace_back();
      const std::size_t every = (touches.size() + most_touches - 1) / most_touches;
      for (std::size_t i = 0; i < touches.size(); i += every) {
        const Pose& pose = touches[i].touch.T_robot_sensor;
        presses.poses.push_back({setup.mm * pose.translation_mm, setup.rad * pose.theta_rad});
        presses.middle_mm += presses.poses.back().translation_mm;
        std::vector<std::uint8_t>& contact = presses.contact.emplace_back();
        for (std::size_t e = 0; e < setup.elements_mm.size(); e += every_element) {
          const Reading reading = touches[i].readings[e];
          contact.push_back(reading == Reading::unknown ? 2 : is_contact(reading) ? 1 : 0);
        }
      }
      presses.middle_mm /= static_cast<double>(presses.poses.size());
      for (const Pose& pose : presses.poses) {
        presses.span_mm =
            std::max(presses.span_mm, glm::distance(pose.translation_mm, presses.middle_mm));
      }
    }
    const std::size_t limit = most_touches * elements_mm_.size() + 1;
    for (std::size_t n = 0; n <= limit; ++n) {
      log_gamma_half_.push_back(std::lgamma(static_cast<double>(n) + 0.5) - std::lgamma(0.5));
      log_factorial_.push_back(std::lgamma(static_cast<double>(n) + 1.0));
    }
  }

  FoundMount run() const {
    constexpr double step_mm = 3.0;
    constexpr double square_mm = 3.0;
    constexpr int angles = 30;
    constexpr std::size_t most_refined = 40;
    std::vector<FoundMount> found;
    const int limit = static_cast<int>(farthest_mount_mm / step_mm);
    for (int x = -limit; x <= limit; ++x) {
      for (int y = -limit; y <= limit; ++y) {
        for (int a = 0; x * x + y * y <= limit * limit && a < angles; ++a) {
          found.push_back(
              {{middle_mm_ + step_mm * glm::dvec2(x, y), a * 2.0 * std::numbers::pi / angles}});
        }
      }
    }
    tbb::enumerable_thread_specific<Squares> squares;
    tbb::parallel_for(std::size_t{0}, found.size(), [&](std::size_t k) {
      found[k].nats = nats(found[k].offset, square_mm, squares.local(), 2);
    });
    const auto fewer = std::min(most_refined, found.size());
    std::ranges::partial_sort(found, found.begin() + static_cast<std::ptrdiff_t>(fewer),
                              std::ranges::greater{}, &FoundMount::nats);
    found.resize(fewer);
    tbb::parallel_for(std::size_t{0}, found.size(),
                      [&](std::size_t k) { found[k] = refined(found[k], squares.local()); });
    FoundMount best = *std::ranges::max_element(found, {}, &FoundMount::nats);
    best.offset = best.offset * Pose{-middle_mm_, 0.0};
    best.offset.theta_rad = wrap_angle(best.offset.theta_rad);
    return best;
  }

 private:
  /// @param place of the array's middle in the tool
  /// @param every of so many touches one counts
  double nats(const Pose& place, double square_mm, Squares& squares, std::size_t every = 1) const {
    std::vector<glm::dvec2> elements_mm;
    for (const glm::dvec2& p : elements_mm_) {
      elements_mm.push_back(place * p);
    }
    double sum = 0.0;
    for (const Presses& presses : objects_) {
      const double half_mm =
          presses.span_mm + glm::length(place.translation_mm) + reach_mm_ + square_mm;
      squares.begin(static_cast<std::size_t>(2.0 * half_mm / square_mm) + 2);
      const glm::dvec2 corner = presses.middle_mm - half_mm;
      for (std::size_t i = 0; i < presses.poses.size(); i += every) {
        const Pose& pose = presses.poses[i];
        const double c = std::cos(pose.theta_rad) / square_mm;
        const double s = std::sin(pose.theta_rad) / square_mm;
        const glm::dvec2 at = (pose.translation_mm - corner) / square_mm;
        for (std::size_t e = 0; e < elements_mm.size(); ++e) {
          const glm::dvec2& p = elements_mm[e];
          if (presses.contact[i][e] < 2) {
            squares.add(static_cast<std::size_t>(at.x + c * p.x - s * p.y),
                        static_cast<std::size_t>(at.y + s * p.x + c * p.y),
                        presses.contact[i][e] == 1);
          }
        }
      }
      sum += squares.take(log_gamma_half_, log_factorial_);
    }
    return sum;
  }

  /// A pattern search on finer and finer squares.
  FoundMount refined(FoundMount from, Squares& squares) const {
    struct Level {
      double square_mm, step_mm, step_rad;
    };
    constexpr std::array levels{Level{2.0, 2.0, 0.12}, Level{1.5, 1.0, 0.06},
                                Level{1.5, 0.5, 0.03}};
    for (const Level& level : levels) {
      const auto value_of = [&](const Pose& at) { return nats(at, level.square_mm, squares); };
      const auto neighbours_of = [&](const Pose& at) {
        std::vector<Pose> neighbours;
        for (const auto& [x, y, turn] :
             {std::array{1, 0, 0}, {-1, 0, 0}, {0, 1, 0}, {0, -1, 0}, {0, 0, 1}, {0, 0, -1}}) {
          neighbours.push_back({at.translation_mm + level.step_mm * glm::dvec2(x, y),
                                at.theta_rad + level.step_rad * turn});
        }
        return neighbours;
      };
      const auto [offset, best] =
          climb(Summit<Pose>{from.offset, value_of(from.offset)}, neighbours_of, value_of);
      from = {offset, best};
    }
    return from;
  }

  glm::dvec2 middle_mm_;                 ///< of the array
  std::vector<glm::dvec2> elements_mm_;  ///< about it
  std::vector<Presses> objects_;
  double reach_mm_ = 0.0;
  std::vector<double> log_gamma_half_;  ///< [n] lgamma(n + 1/2) - lgamma(1/2)
  std::vector<double> log_factorial_;
};

}  // namespace

FoundMount search_mount(const SetupJudge& judge, const Setup& setup) {
  return MountSearch(judge, setup).run();
}

}  // namespace palpate
