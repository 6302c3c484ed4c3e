#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <vector>

#include "limits.hpp"
#include "palpate/bounded_posterior.hpp"
#include "synthetic.hpp"

namespace palpate {

/// The shape of an L, and a disc of twice its weight.
const std::vector<Hypothesis>& two_shapes();

/// Two maps of random cells, the second of three times the first one's weight.
const std::vector<Hypothesis>& two_made_up();

/// 13 x 12 x 16 bins.
BoundedOptions small_options();

/// Touches of the L, at one pose.
Recording touches_of_l(std::size_t touches, std::uint64_t seed);

double sum(std::span<const double> values);

/// Expects the call to throw an Error of the user's input, in one line that says this.
void expect_refused(const std::function<void()>& call, const std::string& says);

}  // namespace palpate
