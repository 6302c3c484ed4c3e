#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include "palpate/api.hpp"
#include "palpate/contact.hpp"

namespace palpate {

/// What a map says at a place on the object: all that the likelihood of a reading depends on.
struct MapSample {
  double log_odds = 0.0;  ///< of occupancy, interpolated bilinearly between the cells, in nats
};

/// The log-likelihood of readings as numbers, in the place of Eq. 7: linear in the log odds between
/// equally spaced nodes, constant beyond the first and the last. It tells up to
/// `most_reading_levels` levels apart: No Contact, and In Contact by pressure.
struct PALPATE_API LikelihoodTable {
  double first_log_odds = -8.0;  ///< of the first node, in nats
  double last_log_odds = 8.0;    ///< of the last node, in nats
  std::size_t nodes = 0;
  /// Ascending pressures in the recording's unit. An element in contact (Eq. 3) is at the first
  /// level of contact, and one level higher for every edge that its pressure reaches.
  std::vector<double> level_edges;
  /// In nats: [level, node] for all objects together, or [object, level, node]. No Contact is the
  /// first level.
  std::vector<double> log_likelihood;

  /// Number of levels, No Contact included.
  std::size_t levels() const { return level_edges.size() + 2; }
  /// 1 where all objects share the numbers, or else the number of objects; 0 without 2 nodes.
  std::size_t sets() const { return nodes < 2 ? 0 : log_likelihood.size() / (levels() * nodes); }
  /// Throws Error unless there are 2 nodes or more, at least 0.001 nats apart and within 1000 nats;
  /// finite, ascending edges, of at most `most_reading_levels` levels; and finite numbers of at
  /// most 1e30 nats for every node of every level, of one set or several.
  void validate() const;
};

/// gamma of Eq. 7 unless it is given, or learned.
inline constexpr double usual_gamma = 0.1;

/// What the sensor says about a place: the class of every reading (Eq. 3), and how likely a reading
/// is, given what the map says there (Eq. 7, or a table).
struct PALPATE_API ContactModel {
  ContactClassifier classifier = {};
  double gamma = usual_gamma;  ///< of Eq. 7: how often the classifier answers at random, in [0, 1)
  /// m: of Eq. 7, and of the space beyond the maps. By default the maps' own, which must then be
  /// the same for all: unequal priors would favour one map over another where an element lies
  /// beyond both.
  std::optional<double> prior = {};
  std::optional<LikelihoodTable> table = {};  ///< in the place of Eq. 7

  /// Throws Error on a threshold, ratio, gamma, prior or table out of range.
  void validate() const;
  /// The class of every element, [e], with In Contact divided into the table's levels. Throws Error
  /// on a touch that is not sound, or a threshold or ratio out of range.
  std::vector<Reading> classify(const Touch& touch) const;
  /// Log-likelihood of a reading in nats, 0 for Unknown:
  ///   Eq. 7: log(gamma m + (1 - gamma) p), p = 1 / (1 + exp(-l)) for contact at log odds l,
  ///   1 / (1 + exp(l)) for none; with gamma = 0 without a floor, however large l is.
  /// The prior must be set for Eq. 7 with gamma > 0.
  /// @param object index of the object whose numbers are used; ignored where all objects share one
  /// set
  /// @throws Error where the table has no numbers for this reading or object
  double log_likelihood(Reading reading, const MapSample& map, std::size_t object = 0) const;
};

}  // namespace palpate
