#include "streaming/rest_finder.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>

namespace palpate {

namespace {

constexpr double block_s = 0.1;
constexpr double step_s = 0.5;  // a press is applied in less
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

std::vector<float> opening(std::span<const double> time_s, std::span<const float> values,
                           double window_s) {
  return running(time_s, running(time_s, values, window_s, std::less<>{}), window_s,
                 std::greater<>{});
}

/// The opening, where windows that begin with the stream or end with it count at any length: a
/// stream that begins and ends untouched is then seen right to its ends.
std::vector<float> opening_to_the_ends(std::span<const double> time_s,
                                       std::span<const float> values, double window_s) {
  std::vector<float> opened = opening(time_s, values, window_s);
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

}  // namespace

/// What an opening tells of the whole array.
struct RestFinder::Opened {
  std::vector<float> above;  ///< [b] how far the most loaded element reads above its rest
  std::size_t steps = 0;     ///< blocks at which a rest has just risen by the onset
  std::optional<double> first_step_s;
};

void Rest::at(double elapsed_s, std::vector<double>& rest) const {
  const std::size_t e = time_s.empty() ? 0 : readings.size() / time_s.size();
  rest.resize(e);
  if (e == 0) {
    return;
  }
  const auto after =
      static_cast<std::size_t>(std::ranges::upper_bound(time_s, elapsed_s) - time_s.begin());
  const std::size_t high = std::min(after, time_s.size() - 1);
  const std::size_t low = after == 0 ? 0 : after - 1;
  const double part = high == low ? 0.0 : (elapsed_s - time_s[low]) / (time_s[high] - time_s[low]);
  for (std::size_t k = 0; k < e; ++k) {
    rest[k] = std::lerp(double{readings[low * e + k]}, double{readings[high * e + k]}, part);
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

/// By how much the opening lies below the readings of the untouched array, for noise: the mean
/// where it is known which blocks are untouched, else the lower quartile over all.
float RestFinder::low_by(std::span<const float> values, std::span<const float> rest,
                         std::span<const float> above) const {
  double sum = 0.0;
  double count = 0.0;
  for (std::size_t i = 0; i < above.size(); ++i) {
    if (above[i] <= onset_) {
      sum += values[i] - rest[i];
      count += 1.0;
    }
  }
  if (count > 0.0) {
    return static_cast<float>(sum / count);
  }
  std::vector<float> differences(values.begin(), values.end());
  for (std::size_t i = 0; i < rest.size(); ++i) {
    differences[i] -= rest[i];
  }
  return quantile(differences, 0.25);
}

/// Opens all elements' readings, times `sign`, and writes the rest [b, e] where it is asked for.
/// @param above of an opening before, which tells where the array is untouched; or empty
RestFinder::Opened RestFinder::open(float sign, double window_s, std::span<const float> above,
                                    std::vector<float>* readings) const {
  const std::size_t blocks = time_s_.size();
  Opened opened{.above = std::vector<float>(blocks, 0.0F)};
  std::vector<std::uint8_t> step(blocks, 0);
  if (readings != nullptr) {
    readings->assign(readings_.size(), 0.0F);
  }
  for (std::size_t k = 0; k < elements_; ++k) {
    if (!is_alive(k)) {
      continue;
    }
    const std::vector<float> values = column(k, sign);
    std::vector<float> rest = opening(time_s_, values, window_s);
    const float low = low_by(values, rest, above);
    std::size_t before = 0;
    std::size_t long_before = 0;
    for (std::size_t i = 0; i < blocks; ++i) {
      rest[i] += low;
      opened.above[i] = std::max(opened.above[i], values[i] - rest[i]);
      for (; time_s_[before] < time_s_[i] - step_s; ++before) {
      }
      for (; time_s_[long_before] < time_s_[i] - 2.0 * step_s; ++long_before) {
      }
      const float drift = std::max(0.0F, rest[before] - rest[long_before]);
      const bool known = time_s_[i] - time_s_.front() > 2.0 * step_s;
      step[i] |= known && rest[i] - rest[before] - drift > onset_ ? 1 : 0;
      if (readings != nullptr) {
        (*readings)[i * elements_ + k] = rest[i];
      }
    }
  }
  for (std::size_t i = 0; i < blocks; ++i) {
    if (step[i] != 0) {
      ++opened.steps;
      opened.first_step_s = opened.first_step_s.value_or(time_s_[i]);
    }
  }
  return opened;
}

/// open(), with what is untouched by an opening before.
RestFinder::Opened RestFinder::settle(float sign, double window_s,
                                      std::vector<float>* readings) const {
  return open(sign, window_s, open(sign, window_s, {}, nullptr).above, readings);
}

double RestFinder::window_for(float sign) const {
  constexpr double shortest_s = 2.0;
  constexpr double longest_s = 32.0;
  double best_s = shortest_s;
  std::size_t fewest = std::numeric_limits<std::size_t>::max();
  for (double window_s = shortest_s; window_s <= longest_s; window_s *= 2.0) {
    const std::size_t steps = settle(sign, window_s, nullptr).steps;
    if (steps == 0) {
      return window_s;
    }
    if (2 * steps < fewest) {
      fewest = steps;
      best_s = window_s;
    }
  }
  return best_s;
}

/// How far each block's most distant element lies above its rest, or below it for the sign -1, [b].
std::vector<float> RestFinder::departure(float sign, double window_s) const {
  std::vector<float> highest(time_s_.size(), 0.0F);
  for (std::size_t k = 0; k < elements_; ++k) {
    if (!is_alive(k)) {
      continue;
    }
    const std::vector<float> values = column(k, sign);
    const std::vector<float> rest = opening_to_the_ends(time_s_, values, window_s);
    for (std::size_t i = 0; i < values.size(); ++i) {
      highest[i] = std::max(highest[i], values[i] - rest[i]);
    }
  }
  return highest;
}

/// Whether the readings fall in presses. What departs from the rest does so first when the first
/// press begins and last when the last press ends; seen from the level of the presses, the rest
/// departs from it first when the first press ends.
bool RestFinder::falls() const {
  const double window_s = std::max(window_for(1.0F), window_for(-1.0F));
  const std::vector<float> up = departure(1.0F, window_s);
  const std::vector<float> down = departure(-1.0F, window_s);
  const float highest = std::max(*std::ranges::max_element(up), *std::ranges::max_element(down));
  const auto departs = [&](float by) {
    return by > std::max(static_cast<float>(onset_), 0.3F * highest);
  };
  const auto first = [&](const std::vector<float>& by) {
    return std::ranges::find_if(by, departs) - by.begin();
  };
  const auto last = [&](const std::vector<float>& by) {
    return std::find_if(by.rbegin(), by.rend(), departs) - by.rbegin();
  };
  return first(down) < first(up) && last(down) < last(up);
}

Rest RestFinder::find(std::optional<double> window_s) {
  if (begin_s_) {
    end_block();
  }
  Rest rest;
  if (time_s_.empty()) {
    return rest;
  }
  rest.window_s = window_s ? *window_s : window_for(1.0F);
  rest.time_s = time_s_;
  const Opened opened = settle(1.0F, rest.window_s, &rest.readings);
  rest.rises_s = opened.first_step_s;
  rest.falls = falls();
  for (std::size_t i = 0, end = 0; i < time_s_.size(); i = end + 1) {
    for (end = i; end < time_s_.size() && opened.above[end] > release_; ++end) {
    }
    if (i == 0 || end == time_s_.size()) {
      continue;
    }
    const double across_s = time_s_[end] - time_s_[i - 1];
    for (std::size_t b = i; b < end; ++b) {
      const auto part = static_cast<float>((time_s_[b] - time_s_[i - 1]) / across_s);
      for (std::size_t k = 0; k < elements_; ++k) {
        rest.readings[b * elements_ + k] = std::lerp(rest.readings[(i - 1) * elements_ + k],
                                                     rest.readings[end * elements_ + k], part);
      }
    }
  }
  return rest;
}

}  // namespace palpate
