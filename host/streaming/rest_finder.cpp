#include "streaming/rest_finder.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>

namespace palpate {

namespace {

constexpr double block_s = 0.1;
constexpr double step_s = 3.0;            // a press rises by the onset in less, and falls so
constexpr std::size_t longest_foot = 50;  // blocks; what falls on for longer is drift
constexpr double never = std::numeric_limits<double>::infinity();
constexpr float unknown_reading = std::numeric_limits<float>::quiet_NaN();

/// The quantile; reorders the values.
float quantile(std::span<float> values, double part) {
  const auto at = static_cast<std::ptrdiff_t>(part * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), values.begin() + at, values.end());
  return values[static_cast<std::size_t>(at)];
}

/// The most of `values` by `better` among those at most half a window away in time; a deque of
/// candidates makes it O(1) a value.
template <typename Better>
std::vector<float> running(std::span<const double> time_s, std::span<const float> values,
                           double window_s, Better better) {
  std::vector<float> best(values.size());
  std::vector<std::size_t> candidates(values.size());
  std::size_t front = 0;
  std::size_t back = 0;
  std::size_t next = 0;
  for (std::size_t i = 0; i < values.size(); ++i) {
    for (; next < values.size() && time_s[next] <= time_s[i] + 0.5 * window_s; ++next) {
      while (back > front && !better(values[candidates[back - 1]], values[next])) {
        --back;
      }
      candidates[back++] = next;
    }
    while (time_s[candidates[front]] < time_s[i] - 0.5 * window_s) {
      ++front;
    }
    best[i] = values[candidates[front]];
  }
  return best;
}

/// The morphological opening, where windows that begin with the stream or end with it count at any
/// length: what the stream begins or ends with is rest.
std::vector<float> opening(std::span<const double> time_s, std::span<const float> values,
                           double window_s) {
  std::vector<float> opened =
      running(time_s, running(time_s, values, window_s, std::less<>{}), window_s, std::greater<>{});
  const std::size_t n = values.size();
  float from_begin = std::numeric_limits<float>::infinity();
  float to_end = from_begin;
  for (std::size_t i = 0; i < n; ++i) {
    from_begin = std::min(from_begin, values[i]);
    to_end = std::min(to_end, values[n - 1 - i]);
    opened[i] = std::max(opened[i], from_begin);
    opened[n - 1 - i] = std::max(opened[n - 1 - i], to_end);
  }
  return opened;
}

/// Fills unknown values by the one before, the first by the one after; 0 where none is known.
void fill_unknown(std::span<float> values) {
  const auto known = std::ranges::find_if(values, [](float v) { return !std::isnan(v); });
  float last = known == values.end() ? 0.0F : *known;
  for (float& value : values) {
    value = std::isnan(value) ? last : value;
    last = value;
  }
}

/// The standard deviation of the noise, by the lower quartile of second differences, which neither
/// drift nor the edges of presses reach.
float noise_of(std::span<const float> values) {
  std::vector<float> differences;
  for (std::size_t i = 2; i < values.size(); ++i) {
    differences.push_back(std::abs(values[i - 2] - 2.0F * values[i - 1] + values[i]));
  }
  return differences.empty() ? 0.0F : quantile(differences, 0.25) / (0.3186F * std::sqrt(6.0F));
}

}  // namespace

/// What stands out of a rest.
struct RestFinder::Outline {
  double foot;                            ///< what is higher than this, and nowhere less, is one
  std::vector<float> above = {};          ///< [b] how far the highest element stands out
  std::vector<std::size_t> element = {};  ///< [b] which it is

  void add(std::size_t which, std::span<const float> values, std::span<const float> rest) {
    above.resize(values.size(), 0.0F);
    element.resize(values.size(), 0);
    for (std::size_t i = 0; i < values.size(); ++i) {
      const float by = values[i] - rest[i];
      element[i] = by > above[i] ? which : element[i];
      above[i] = std::max(above[i], by);
    }
  }
};

/// A rest, and where it is a line across a press.
struct RestFinder::Found {
  Rest rest;
  std::vector<std::uint8_t> pressed;  ///< [b]
  std::vector<float> raised;          ///< [b] what hides a press that is cut off
  double slow_s = never;              ///< when the first begins that is no press
};

void Rest::at(double elapsed_s, std::vector<double>& rest) const {
  const std::size_t b = time_s.size();
  const std::size_t e = b == 0 ? 0 : readings.size() / b;
  rest.resize(e);
  if (e == 0) {
    return;
  }
  const auto after =
      static_cast<std::size_t>(std::ranges::upper_bound(time_s, elapsed_s) - time_s.begin());
  const std::size_t high = std::min(after, b - 1);
  const std::size_t low = after == 0 ? 0 : after - 1;
  const double part = high == low ? 0.0 : (elapsed_s - time_s[low]) / (time_s[high] - time_s[low]);
  for (std::size_t k = 0; k < e; ++k) {
    rest[k] = std::lerp(double{readings[k * b + low]}, double{readings[k * b + high]}, part);
  }
}

RestFinder::RestFinder(std::span<const std::uint8_t> valid, double onset, double release)
    : valid_(valid.begin(), valid.end()),
      onset_(onset),
      release_(release),
      smoother_(block_s, block_s) {}

void RestFinder::add(const Frame& frame) {
  if (!is_readable(frame, valid_)) {
    return;
  }
  elements_ = frame.values.size();
  const double time_s = time_.advance(frame.host_time_s);
  // The last frame of a block tells all of it, but a silence may not stretch a block.
  if (begin_s_ && time_s - *begin_s_ >= block_s) {
    end_block();
  }
  begin_s_ = begin_s_.value_or(time_s);
  last_s_ = time_s;
  pressure_.resize(elements_);
  known_.resize(elements_, 0);
  for (std::size_t k = 0; k < elements_; ++k) {
    const bool known = is_alive(k) && is_known(frame.values[k]);
    pressure_[k] = known ? frame.values[k] : std::numeric_limits<double>::quiet_NaN();
    known_[k] |= known ? 1 : 0;
  }
  smoother_.add(time_s, pressure_);
}

void RestFinder::end_block() {
  time_s_.push_back(0.5 * (*begin_s_ + last_s_));
  for (std::size_t k = 0; k < elements_; ++k) {
    readings_.push_back(known_[k] != 0 ? static_cast<float>(smoother_.means()[k])
                                       : unknown_reading);
  }
  known_.assign(elements_, 0);
  begin_s_.reset();
}

/// An element's readings [b] times `sign`, without what is unknown or wild: a few frames of -1e38
/// are no rest.
std::vector<float> RestFinder::column(std::size_t element, float sign) const {
  std::vector<float> values;
  for (std::size_t i = element; i < readings_.size(); i += elements_) {
    values.push_back(sign * readings_[i]);
  }
  fill_unknown(values);
  std::vector<float> sorted = values;
  const float low = quantile(sorted, 0.25);
  const float high = quantile(sorted, 0.75);
  const auto onset = static_cast<float>(onset_);
  const float least = low - 4.0F * (high - low) - 100.0F * onset;
  const float limit = high + 4.0F * (high - low) + 1e4F * onset;
  std::ranges::replace_if(
      values, [&](float v) { return v < least || v > limit; }, unknown_reading);
  fill_unknown(values);
  return values;
}

/// Opens all elements' readings, times `sign`, and writes the rest [e, b]: the opening, lifted by
/// the mean of the readings near it, so that it lies amid the noise of the untouched array.
/// @returns what stands out of the rest
RestFinder::Outline RestFinder::open(float sign, double window_s, std::vector<float>& rest) const {
  Outline outline{.foot = release_};
  for (std::size_t k = 0; k < elements_; ++k) {
    const std::vector<float> values =
        is_alive(k) ? column(k, sign) : std::vector<float>(time_s_.size(), 0.0F);
    std::vector<float> opened = opening(time_s_, values, window_s);
    const float near = 3.5F * noise_of(values);
    double sum = 0.0;
    double count = 0.0;
    for (std::size_t i = 0; i < values.size(); ++i) {
      const float by = values[i] - opened[i];
      sum += by <= near ? by : 0.0F;
      count += by <= near ? 1.0 : 0.0;
    }
    std::ranges::for_each(opened, [&](float& v) { v += static_cast<float>(sum / count); });
    outline.add(k, values, opened);
    rest.insert(rest.end(), opened.begin(), opened.end());
  }
  return outline;
}

/// What stands out of a rest as a longer window leaves it.
RestFinder::Outline RestFinder::humps(double window_s, std::span<const float> rest) const {
  Outline outline{.foot = 0.25 * onset_};
  for (std::size_t k = 0; k < elements_; ++k) {
    const auto values = rest.subspan(k * time_s_.size(), time_s_.size());
    outline.add(k, values, opening(time_s_, values, window_s));
  }
  return outline;
}

/// Makes the rest a line across every press, from foot to foot. A press that is cut off by the
/// stream's begin or end in its edge has no two feet, and is hidden.
/// @param edge_s a press rises from its foot to the onset in less, and falls as fast
void RestFinder::bridge(const Outline& outline, double edge_s, Found& found) const {
  constexpr std::size_t ends = 6;  // blocks
  const std::vector<float>& above = outline.above;
  std::vector<float>& rest = found.rest.readings;
  const std::size_t blocks = above.size();
  for (std::size_t i = 0, end = 0; i < blocks; i = end + 1) {
    std::size_t first = blocks;
    std::size_t last = 0;
    std::size_t peak = i;
    for (end = i; end < blocks && above[end] > outline.foot; ++end) {
      peak = above[end] > above[peak] ? end : peak;
      if (above[end] > onset_) {
        first = std::min(first, end);
        last = end;
      }
    }
    if (last == 0 || end == blocks) {
      continue;
    }
    if (time_s_[first] - time_s_[i] > edge_s || time_s_[end - 1] - time_s_[last] > edge_s) {
      found.slow_s = std::min(found.slow_s, time_s_[i]);
      continue;
    }
    const auto rest_of_peak = std::span(rest).subspan(outline.element[peak] * blocks, blocks);
    const std::size_t from = foot_of(outline, rest_of_peak, i - 1, -1);
    const std::size_t to = foot_of(outline, rest_of_peak, end, 1);
    const auto higher = [&](std::size_t block, std::size_t than) {
      return rest_of_peak[block] - rest_of_peak[than] > onset_;
    };
    if ((from < ends && higher(end, to) && higher(from, to)) ||
        (to + ends > blocks && higher(i - 1, from) && higher(to, from))) {
      for (std::size_t b = from; b <= to; ++b) {
        found.raised[b] = std::max(found.raised[b], above[b]);
      }
      continue;
    }
    for (std::size_t b = from + 1; b < to; ++b) {
      found.pressed[b] = 1;
      const double part = (time_s_[b] - time_s_[from]) / (time_s_[to] - time_s_[from]);
      for (std::size_t k = 0; k < rest.size(); k += blocks) {
        rest[k + b] = std::lerp(rest[k + from], rest[k + to], static_cast<float>(part));
      }
    }
    end = std::max(end, to);
  }
}

/// The last block from `block` on, in steps of `way`, to which an element's rest [b] falls as after
/// a press, with nothing that stands out between.
std::size_t RestFinder::foot_of(const Outline& outline, std::span<const float> rest,
                                std::size_t block, int way) const {
  const auto there = [&](int steps) {  // wraps around before the first
    return static_cast<std::size_t>(static_cast<std::ptrdiff_t>(block) + steps * way);
  };
  const auto falls = [&](int steps, double part) {
    const std::size_t to = there(steps);
    return to < rest.size() &&
           rest[block] - rest[to] > part * onset_ / step_s * std::abs(time_s_[to] - time_s_[block]);
  };
  // The longer way tells slow falls in noise; what jumps further off does not fall here.
  for (std::size_t i = 0;
       i < longest_foot && (falls(3, 1.0) || (falls(10, 1.0) && falls(5, 0.1))) &&
       outline.above[there(1)] <= outline.foot;
       ++i) {
    block = there(1);
  }
  return block;
}

/// Finds the rest of the readings times `sign`, by the given window or by all.
RestFinder::Found RestFinder::rest_of(float sign, std::optional<double> window_s) const {
  constexpr double shortest_s = 2.0;
  constexpr double longest_s = 32.0;
  const double until_s = window_s.value_or(longest_s);
  Found found{.rest = {.window_s = until_s, .time_s = time_s_},
              .pressed = std::vector<std::uint8_t>(time_s_.size(), 0),
              .raised = std::vector<float>(time_s_.size(), 0.0F)};
  std::vector<float>& rest = found.rest.readings;
  bridge(open(sign, std::min(shortest_s, until_s), rest), never, found);
  for (double wide_s = window_s.value_or(2.0 * shortest_s); wide_s <= until_s; wide_s *= 2.0) {
    found.slow_s = never;
    bridge(humps(wide_s, rest), window_s ? never : 0.75 * step_s, found);
  }
  return found;
}

/// When an element's rest [e, b] first rises or falls by the onset in step_s beside drift, which
/// goes on before or after.
double RestFinder::first_step(std::span<const float> rest) const {
  constexpr auto step = static_cast<std::size_t>(step_s / block_s);
  const std::size_t blocks = time_s_.size();
  std::size_t first = blocks;
  for (std::size_t k = 0; k < rest.size(); k += blocks) {
    for (std::size_t i = 1; i < first; ++i) {
      const std::size_t from = i - std::min(i, step);
      const std::size_t to = std::min(i + step, blocks - 1);
      const float by = rest[k + i] - rest[k + from];
      const float way = std::copysign(1.0F, by);
      const float after = way * (rest[k + to] - rest[k + i]);
      const float before = i < 2 * step ? after : way * (rest[k + from] - rest[k + from - step]);
      const float drift = std::max(0.0F, to < i + step ? before : std::min(before, after));
      first = std::abs(by) - drift > onset_ ? i : first;
    }
  }
  return first < blocks ? time_s_[first] : never;
}

Rest RestFinder::find(std::optional<double> window_s) {
  if (begin_s_) {
    end_block();
  }
  if (time_s_.empty()) {
    return {};
  }
  const Found up = rest_of(1.0F, {});
  const Found down = rest_of(-1.0F, {});
  Found found = window_s ? rest_of(1.0F, window_s) : up;
  Rest& rest = found.rest;
  // Gaps between presses look like presses of the other sign, but the first press begins before
  // the first gap, and the last press ends after the last gap.
  rest.falls = down.pressed > up.pressed &&
               std::lexicographical_compare(up.pressed.rbegin(), up.pressed.rend(),
                                            down.pressed.rbegin(), down.pressed.rend());
  const double changes_s = std::min(found.slow_s, first_step(rest.readings));
  rest.changes_s = changes_s < never ? std::optional(changes_s) : std::nullopt;
  for (std::size_t i = 0; i < rest.readings.size(); ++i) {
    rest.readings[i] += found.raised[i % time_s_.size()];
  }
  return rest;
}

}  // namespace palpate
