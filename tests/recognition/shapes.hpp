#pragma once

#include <gtest/gtest.h>

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "palpate/estimate.hpp"
#include "palpate/touch.hpp"
#include "recognition/recognition_record.hpp"
#include "recognition/recognition_task.hpp"
#include "support/shared_device.hpp"

namespace palpate {

/// Maps of the letter L and of a disc of full symmetry.
std::vector<Hypothesis> shapes();

/// The shapes, and the letter L again: two labels of three maps.
std::vector<Hypothesis> three_maps();

/// A histogram, particles and bounds: over a lattice on which few touches tell the shapes apart,
/// and as many particles as it has bins.
std::vector<FilterOptions> every_filter();

/// Six touches of the letter at a pose within the lattice, with the truth.
Recording touched_letter(std::uint64_t seed);
/// Six touches of the disc at a pose within the lattice, with the truth.
Recording touched_disc(std::uint64_t seed);

/// What a new recogniser tells of all touches of a recording as one unknown.
RecognitionRecord recognised(const RecognitionTask& task, const Recording& recording,
                             bool trace = false);
/// Its last step.
RecognitionStep last_step(const RecognitionTask& task, const Recording& recording);

/// Tests by each filter.
class ByEveryFilter : public testing::TestWithParam<int> {
 protected:
  FilterOptions filter() const { return every_filter()[GetParam()]; }
  bool bounded() const { return std::holds_alternative<BoundedOptions>(filter()); }
};

inline const auto each_filter = testing::Range(0, 3);

/// The name of the filter that a test is by.
inline std::string filter_name(const testing::TestParamInfo<int>& test) {
  constexpr std::array names{"Histogram", "Particles", "Bounds"};
  return names.at(test.param);
}

}  // namespace palpate
