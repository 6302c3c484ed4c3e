#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <set>
#include <span>
#include <string>
#include <vector>

#include <glm/vec2.hpp>

#include "palpate/contact_model.hpp"
#include "palpate/map_builder.hpp"
#include "palpate/touch.hpp"

namespace palpate {

struct TriedTouch;

/// How the touches are tried.
struct Setup {
  std::vector<glm::dvec2> elements_mm;   ///< [e] in the order of the readings
  double mm = 1.0;                       ///< that the poses' unit of length has
  double rad = 1.0;                      ///< that the poses' unit of angle has
  std::vector<std::uint8_t> valid = {};  ///< [e] 0: dead, whatever the recording says; empty: none
  std::set<const TriedTouch*> left_out = {};
};

/// A touch in contact, and where it stands.
struct TriedTouch {
  Touch touch;
  std::vector<Reading> readings;  ///< [e] whatever the set-up is
  std::string recording;
  std::size_t index = 0;  ///< in the recording
};

/// How touches fit maps that they are no part of.
struct SetupFit {
  std::size_t touches = 0;
  std::size_t misfits = 0;
  double told = 0.0;  ///< nats by which the maps tell the readings better than the prior does

  /// Of sound set-ups hardly a touch is a misfit. A set-up that is to be `named` has to fit better
  /// than one that is left as it is, whose poses may be a little off.
  bool is_sound(bool named) const {
    return misfits <= std::max(least_misfits, touches / (named ? 50 : 20)) && told > 0.0;
  }
  static constexpr std::size_t least_misfits = 2;
};

/// The predictive likelihood of set-ups: that of each half of an object's touches, every other one,
/// on the map that the other half makes.
class SetupJudge {
 public:
  using Take = std::function<void(const TriedTouch& given, const Touch& tried,
                                  const OccupancyGrid& map_of_the_others)>;

  /// @param recordings outlive this object
  /// @throws Error where an object has fewer than four touches in contact, or all elements are in
  /// contact in all touches
  SetupJudge(Device& device, std::span<const Recording> recordings, const MapOptions& options);

  /// Log-likelihood of all readings (Eq. 7), in nats; -1e300 where the touches lie so far apart
  /// that no map holds them.
  double nats(const Setup& setup);

  /// Whether the touches fit the maps of the others, by `fits_from_z`, as those of sound set-ups
  /// do, and the maps tell of them. @throws Error as MapBuilder does
  SetupFit fit(const Setup& setup);

  /// Visits every touch as the set-up has it. @throws Error as MapBuilder does
  void visit(const Setup& setup, const Take& take);

  /// By object.
  const std::map<std::string, std::vector<TriedTouch>>& touches() const { return touches_; }
  /// With the prior that the touches of the first set-up tell.
  const ContactModel& contact() const { return contact_; }

 private:
  Device& device_;
  MapOptions options_;
  ContactModel contact_;
  std::map<std::string, std::vector<TriedTouch>> touches_;
};

}  // namespace palpate
