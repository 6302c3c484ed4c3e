#pragma once

#include <cstddef>
#include <span>

namespace palpate {

struct Interval {
  double low = 0.0;
  double high = 0.0;
};

/// The 95 % score interval of a probability of which `successes` of `trials` are known (Wilson
/// 1927). Unlike the normal approximation's it is not empty where all or none succeed.
/// trials > 0; `successes` may be a fraction, of an estimate that varies no more than a binomial's.
Interval wilson_interval(double successes, std::size_t trials);

/// The fraction of all pairs, of a value of one kind and one of the other, in which the value of
/// `lower` is the lower one (the area under the ROC curve); a tie counts half. Neither is empty.
double told_apart(std::span<const double> lower, std::span<const double> higher);

/// Standard error of told_apart() of so many values of each kind (Hanley and McNeil 1982, eq. 1,
/// with the variances of exponentially distributed values); 0 for an area of 0 or 1.
double told_apart_error(double area, std::size_t lower, std::size_t higher);

}  // namespace palpate
