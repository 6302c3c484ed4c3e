#pragma once

#include <optional>
#include <span>
#include <vector>

#include "learning/level_counts.hpp"
#include "learning/press.hpp"
#include "palpate/contact.hpp"

namespace palpate {

/// The contact threshold T and ratio of touches, by Otsu's method (1979): the threshold parts the
/// logarithms of all pressures above 0 into two classes of the largest variance between them, and
/// the ratio likewise those relative to the largest of their touch, of touches that exceed T; the
/// usual ratio where these are all the same.
/// @param threshold the T to learn the ratio for, where it is known
/// @throws Error where T is to be learned and no pressure is above 0, or all are the same
ContactClassifier learn_classifier(const std::vector<Press>& presses,
                                   std::optional<double> threshold = {});

/// Standard deviation of untouched elements: of those farther than two element spacings from any
/// element In Contact of their touch. Where no pressure is negative, half of the noise is taken to
/// be cut off at 0. 0 where there are no such elements.
double noise_floor(const std::vector<Press>& presses, const ContactClassifier& classifier);

/// Gamma of Eq. 7 under which readings are most likely where the log odds are known.
/// @param counts of two levels over log odds; nodes of cells that nothing sensed are left out
double fit_gamma(const LevelCounts& counts, double prior);

/// The share of elements In Contact among the known ones, in [0.01, 0.5]: the object's area over
/// the area that touches sensed.
double share_in_contact(std::span<const Touch> touches, const ContactClassifier& classifier);

}  // namespace palpate
