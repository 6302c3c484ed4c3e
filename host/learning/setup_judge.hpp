#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <limits>
#include <map>
#include <optional>
#include <set>
#include <span>
#include <string>
#include <vector>

#include <glm/vec2.hpp>

#include "learning/local_search.hpp"
#include "learning/press.hpp"
#include "learning/setup_check.hpp"
#include "palpate/contact_model.hpp"
#include "palpate/map_builder.hpp"
#include "palpate/touch.hpp"

namespace palpate {

/// A touch in contact, and where it stands.
struct TriedTouch {
  Touch touch;
  std::vector<Reading> readings;  ///< [e] whatever the set-up is
  std::string recording;
  std::size_t index = 0;  ///< in the recording
};

/// How the touches are tried.
struct Setup {
  std::vector<glm::dvec2> elements_mm;   ///< [e] in the order of the readings
  Pose mount = {};                       ///< of the array in the frame of its elements
  double mm = 1.0;                       ///< that the poses' unit of length has
  double rad = 1.0;                      ///< that the poses' unit of angle has
  std::vector<std::uint8_t> valid = {};  ///< [e] 0: dead, whatever the recording says; empty: none
  std::set<const TriedTouch*> left_out = {};

  /// The elements where the mount has them.
  std::vector<glm::dvec2> mounted_mm() const;
  /// T_robot_sensor of a touch in mm and rad.
  Pose pose_of(const TriedTouch& given) const;
};

/// How touches fit maps that they are no part of.
struct SetupFit {
  std::size_t touches = 0;
  std::size_t misfits = 0;
  double told = 0.0;  ///< nats by which the maps tell the readings better than the prior does

  /// In a sound set-up hardly any touch is a misfit. A set-up that is to be `named` has to fit
  /// better than one that is left as it is, whose poses may be a little off.
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
  /// @param most_touches of each that count, evenly chosen
  /// @throws Error where an object has fewer than four touches in contact, or all elements are in
  /// contact in all touches
  SetupJudge(Device& device, std::span<const Recording* const> recordings,
             const MapOptions& options,
             std::size_t most_touches = std::numeric_limits<std::size_t>::max());

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

/// Nats that a finding needs. Of sound set-ups none came near it; see tests/learning.
inline constexpr double least_nats = 12.0;

/// Whether the sensor's angles, in a unit of so many rad, are nearly one.
bool at_one_angle(const SetupJudge& judge, double rad);

/// Where the array sits in the tool, as "array_offset", by Eq. 7 of touches at known poses of
/// objects whose map is drawn. None without any, or where it sits as its elements are said to be.
std::optional<SetupFinding> offset_on_drawings(const std::vector<Press>& presses,
                                               const std::vector<OccupancyGrid>& maps,
                                               const ContactClassifier& classifier);
/// The presses with their arrays at this pose in the frame of the elements.
std::vector<Press> with_offset(std::vector<Press> presses, const Pose& offset);

/// The elements in the order of their readings, and the options of an import that say so.
struct ElementOrder {
  std::vector<std::string> options;
  std::vector<glm::dvec2> elements_mm;
};

/// The order as given, without options, and those of a full grid that no turn of an array makes.
std::vector<ElementOrder> orders_but_for_turns(std::span<const glm::dvec2> elements_mm);

/// Where an order costs less than this part of all that touches tell, it is not told from others.
inline constexpr double least_share = 0.05;

/// The mount under which the touches agree best, within 60 mm and at any angle, coarse to fine to
/// about a millimetre and 2 degrees; its value is to be compared between set-ups of one length.
/// Makes no map; takes all host threads.
Summit<Pose> search_mount(const SetupJudge& judge, const Setup& setup);

/// The likeliest set-up so far, and what was found on the way. Each check_...() adds its finding,
/// if any, and goes on from the set-up that the finding mends.
struct SetupSearch {
  SetupJudge& judge;
  Setup setup;
  double nats = judge.nats(setup);
  SetupCheck check = {};
};

/// The order of the elements that explains the touches better.
void check_order(SetupSearch& search);

/// Where the array sits in the tool, as "array_offset".
void check_offset(SetupSearch& search);

/// How far apart the elements are.
void check_pitch(SetupSearch& search);

}  // namespace palpate
