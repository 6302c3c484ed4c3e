#include "streaming/import_survey.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace palpate {

ImportSurvey::ImportSurvey(std::size_t elements, std::vector<std::uint8_t> valid)
    : valid_(std::move(valid)),
      read_(elements, 0),
      least_(elements, std::numeric_limits<double>::infinity()) {
  valid_.resize(elements, 1);
}

void ImportSurvey::add(std::span<const double> pressure) {
  const std::size_t e = elements();
  for (std::size_t k = 0; k < pressure.size(); ++k) {
    const double p = pressure[k];
    const std::size_t i = k % e;
    if (i == 0) {
      load_.push_back(0.0F);
    }
    if (!std::isfinite(p)) {
      continue;
    }
    read_[i] = 1;
    whole_ = whole_ && p == std::floor(p);
    largest_ = std::max(largest_, p);
    if (valid_[i] != 0) {
      least_[i] = std::min(least_[i], p);
      load_.back() = std::max(load_.back(), static_cast<float>(p - least_[i]));
    }
  }
}

std::vector<bool> ImportSurvey::pressed() const {
  const float most = load_.empty() ? 0.0F : *std::ranges::max_element(load_);
  std::vector<bool> pressed;
  for (const float load : load_) {
    pressed.push_back(load > 0.0F && load >= 0.5F * most);
  }
  return pressed;
}

std::optional<double> ImportSurvey::whole_up_to() const {
  constexpr double least = 100.0;  // thresholded pressures may be small whole numbers
  return whole_ && largest_ >= least ? std::optional(largest_) : std::nullopt;
}

}  // namespace palpate
