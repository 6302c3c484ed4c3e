#include "streaming/press_clock.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include <fmt/format.h>
#include <glm/geometric.hpp>

#include "streaming/pose_between.hpp"

namespace palpate {

namespace {

constexpr double not_known = std::numeric_limits<double>::quiet_NaN();
constexpr double search_s = 10.0;
constexpr std::size_t most_presses = 200;
constexpr std::size_t most_offsets = 8000;
constexpr std::size_t least_presses = 5;
constexpr int samples = 5;  // of the poses in a press
// A press during which the array moves so far counts in full as one against the clocks.
constexpr double much_motion_mm = 2.0;

/// The middle half of a press, in the frames' time.
struct PressInterval {
  double begin_s = 0.0;
  double end_s = 0.0;
};

std::vector<PressInterval> presses_of(std::span<const double> time_s, std::span<const float> load) {
  constexpr double longest_step_s = 0.5;
  constexpr std::size_t least_frames = 3;
  std::vector<float> smooth(load.size(), 0.0F);  // a median over three frames
  for (std::size_t i = 1; i + 1 < load.size(); ++i) {
    const auto [low, high] = std::minmax(load[i - 1], load[i + 1]);
    smooth[i] = std::clamp(load[i], low, high);
  }
  const float peak = load.empty() ? 0.0F : *std::ranges::max_element(smooth);
  std::vector<PressInterval> presses;
  std::size_t first = 0;
  std::size_t frames = 0;
  for (std::size_t i = 0; i < smooth.size(); ++i) {
    const bool pressed = peak > 0.0F && smooth[i] >= 0.5F * peak;
    const bool next = frames > 0 && time_s[i] - time_s[i - 1] <= longest_step_s;
    if (frames >= least_frames && !(pressed && next)) {
      const double quarter_s = 0.25 * (time_s[i - 1] - time_s[first]);
      presses.push_back({time_s[first] + quarter_s, time_s[i - 1] - quarter_s});
    }
    first = pressed && next ? first : i;
    frames = !pressed ? 0 : next ? frames + 1 : 1;
  }
  const std::size_t every = presses.size() / most_presses + 1;
  for (std::size_t k = 0; k * every < presses.size(); ++k) {
    presses[k] = presses[k * every];
  }
  presses.resize((presses.size() + every - 1) / every);
  return presses;
}

/// What the poses do during a press.
struct Stay {
  double motion_mm = not_known;  ///< in the plane
  double height_mm = not_known;  ///< at most
};

Stay stay_of(const PoseLog& poses, const PressInterval& press, double offset_s, double reach_mm) {
  Stay stay{.motion_mm = 0.0,
            .height_mm = poses.height_mm.empty() ? 0.0 : -std::numeric_limits<double>::infinity()};
  Pose first;
  for (int s = 0; s < samples; ++s) {
    const double at_s =
        press.begin_s + s * (press.end_s - press.begin_s) / (samples - 1) + offset_s;
    const auto after = std::ranges::upper_bound(poses.time_s, at_s);
    if (after == poses.time_s.begin() || after == poses.time_s.end()) {
      return {};
    }
    const auto i = static_cast<std::size_t>(after - poses.time_s.begin());
    const double step_s = poses.time_s[i] - poses.time_s[i - 1];
    if (step_s > poses.largest_gap_s) {
      return {};
    }
    const double part = (at_s - poses.time_s[i - 1]) / step_s;
    const Pose pose = between(poses.T_robot_sensor[i - 1], poses.T_robot_sensor[i], part);
    if (!std::isfinite(pose.theta_rad)) {
      return {};
    }
    first = s == 0 ? pose : first;
    stay.motion_mm = std::max(
        stay.motion_mm, glm::distance(pose.translation_mm, first.translation_mm) +
                            reach_mm * std::abs(wrap_angle(pose.theta_rad - first.theta_rad)));
    if (!poses.height_mm.empty()) {
      stay.height_mm =
          std::max(stay.height_mm, std::lerp(poses.height_mm[i - 1], poses.height_mm[i], part));
    }
  }
  return stay;
}

/// All presses at all offsets, and how much each speaks against its offset: 0 to 1.
class Comparison {
 public:
  Comparison(const std::vector<PressInterval>& presses, const PoseLog& poses,
             const std::vector<double>& offsets_s, double reach_mm) {
    for (const double offset_s : offsets_s) {
      double heights_mm = 0.0;
      double known = 0.0;
      auto& stays = stays_.emplace_back();
      for (const PressInterval& press : presses) {
        stays.push_back(stay_of(poses, press, offset_s, reach_mm));
        if (!std::isnan(stays.back().motion_mm)) {
          heights_mm += stays.back().height_mm;
          known += 1.0;
        }
      }
      if (2.0 * known >= static_cast<double>(presses.size())) {
        lowest_mm_ = std::min(lowest_mm_, heights_mm / known);
        highest_mm_ = std::max(highest_mm_, heights_mm / known);
      }
    }
  }

  double sum_against(std::size_t offset) const {
    double sum = 0.0;
    for (const Stay& stay : stays_[offset]) {
      sum += against(stay);
    }
    return sum;
  }
  std::size_t count_against(std::size_t offset) const {
    return static_cast<std::size_t>(std::ranges::count_if(
        stays_[offset], [this](const Stay& stay) { return against(stay) > 0.5; }));
  }

 private:
  double against(const Stay& stay) const {
    if (std::isnan(stay.motion_mm)) {
      return 1.0;
    }
    const double lift_mm = highest_mm_ - lowest_mm_;
    const double lifted = lift_mm > much_motion_mm ? (stay.height_mm - lowest_mm_) / lift_mm : 0.0;
    return std::clamp(std::max(lifted, stay.motion_mm / much_motion_mm), 0.0, 1.0);
  }

  std::vector<std::vector<Stay>> stays_;  ///< [offset][press]
  // Mean heights of the presses, at the offsets where these are extreme.
  double lowest_mm_ = std::numeric_limits<double>::infinity();
  double highest_mm_ = -lowest_mm_;
};

/// Offsets around 0, and around those that let the logs begin and end together.
std::vector<double> offsets_for(std::span<const double> time_s, const PoseLog& poses,
                                double shortest_s) {
  const double begin_s = poses.time_s.front() - time_s.front();
  const double end_s = poses.time_s.back() - time_s.back();
  constexpr double finest_s = 0.02;
  constexpr double coarsest_s = 0.1;
  const double step_s = std::clamp(shortest_s / 4.0, finest_s, coarsest_s);
  std::vector<double> offsets_s;
  const auto add = [&](double from_s, double to_s) {
    for (double k = std::ceil(from_s / step_s); k * step_s <= to_s; ++k) {
      if (offsets_s.size() < most_offsets) {
        offsets_s.push_back(k * step_s);
      }
    }
  };
  const double low_s = std::min(begin_s, end_s) - search_s;
  const double high_s = std::max(begin_s, end_s) + search_s;
  add(-search_s, search_s);
  add(std::max(low_s, search_s + step_s), high_s);
  add(low_s, std::min(high_s, -search_s - step_s));
  std::ranges::sort(offsets_s);
  return offsets_s;
}

/// Offsets next to each other, from the first to the last.
struct Valley {
  std::size_t low;
  std::size_t high;
};

/// The valleys in which `against` is at most `limit`.
std::vector<Valley> valleys_below(double limit, const std::vector<double>& against) {
  std::vector<Valley> valleys;
  for (std::size_t k = 0; k < against.size(); ++k) {
    if (against[k] > limit) {
      continue;
    }
    if (!valleys.empty() && valleys.back().high + 1 == k) {
      valleys.back().high = k;
    } else {
      valleys.push_back({k, k});
    }
  }
  return valleys;
}

}  // namespace

std::optional<ClockOffset> clock_offset(std::span<const double> time_s, std::span<const float> load,
                                        const PoseLog& poses, double reach_mm) {
  const std::vector<PressInterval> presses = presses_of(time_s, load);
  if (presses.size() < least_presses || poses.time_s.size() < 2) {
    return {};
  }
  std::vector<double> lengths_s;
  for (const PressInterval& press : presses) {
    lengths_s.push_back(press.end_s - press.begin_s);
  }
  std::ranges::nth_element(lengths_s, lengths_s.begin() + lengths_s.size() / 2);
  const std::vector<double> offsets_s = offsets_for(time_s, poses, lengths_s[lengths_s.size() / 2]);
  const Comparison comparison(presses, poses, offsets_s, reach_mm);
  std::vector<double> against;
  for (std::size_t k = 0; k < offsets_s.size(); ++k) {
    against.push_back(comparison.sum_against(k));
  }
  const auto none = static_cast<std::size_t>(
      std::ranges::min_element(offsets_s, {}, [](double s) { return std::abs(s); }) -
      offsets_s.begin());
  const auto count = static_cast<double>(presses.size());
  const double least = *std::ranges::min_element(against);
  if (least > 0.25 * count || against[none] - least < std::max(3.0, 0.3 * count)) {
    return {};
  }
  // Of clocks with one epoch the smallest offset is the likeliest; of others 0 means nothing.
  const bool overlap =
      poses.time_s.front() <= time_s.back() && time_s.front() <= poses.time_s.back();
  const double origin_s = overlap ? 0.0 : poses.time_s.front() - time_s.front();
  const auto from_origin_s = [&](const Valley& valley) {
    return std::abs(std::clamp(origin_s, offsets_s[valley.low], offsets_s[valley.high]) - origin_s);
  };
  const auto middle_s = [&](const Valley& valley) {
    return 0.5 * (offsets_s[valley.low] + offsets_s[valley.high]);
  };
  const auto as_good = valleys_below(least + std::max(0.5, 0.03 * count), against);
  const Valley best = *std::ranges::min_element(as_good, {}, from_origin_s);
  ClockOffset offset{.seconds = middle_s(best),
                     .presses = presses.size(),
                     .against = comparison.count_against(none),
                     .left = comparison.count_against((best.low + best.high) / 2)};
  if (!overlap) {
    for (const Valley& rival : valleys_below(least + std::max(2.0, 0.15 * count), against)) {
      const double away_s = std::abs(middle_s(rival) - offset.seconds);
      if (rival.high < best.low || rival.low > best.high) {
        offset.open_s = std::min(offset.open_s.value_or(away_s), away_s);
      }
    }
  }
  return offset;
}

SetupFinding clock_finding(const ClockOffset& offset, double given_s) {
  const std::string option = fmt::format("pose-delay {:.2f}", given_s + offset.seconds);
  const double nats = (static_cast<double>(offset.against) - static_cast<double>(offset.left)) *
                      std::log(19.0);  // one press in twenty is against sound clocks
  if (offset.open_s) {
    return {
        "clock", nats,
        fmt::format("the poses' clock and the frames' have no common beginning, and presses "
                    "tell their offset but for {:.2f} s: with `pose-delay {:.2f}`, next to where "
                    "both logs begin together, the array moves, is lifted, or has no pose in {} of "
                    "{} presses, and {:.2f} s more or less explain about as many; find one "
                    "press in both logs, and give the difference of its times",
                    *offset.open_s, given_s + offset.seconds, offset.left, offset.presses,
                    *offset.open_s)};
  }
  return {"clock",
          nats,
          fmt::format("the poses' clock seems {:.2f} s {}: in {} of {} presses the array moves, is "
                      "lifted, or has no pose; with `{}` in {}",
                      std::abs(offset.seconds), offset.seconds > 0.0 ? "ahead" : "behind",
                      offset.against, offset.presses, option, offset.left),
          {option}};
}

}  // namespace palpate
