#include "recognition/warnings.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <vector>

#include <fmt/format.h>
#include <glm/geometric.hpp>

#include "model/interpolated_map.hpp"
#include "model/predicted_readings.hpp"
#include "recognition/surprise.hpp"

namespace palpate {

namespace {

bool are_surprising(std::span<const double> surprises) {
  if (surprises.size() < surprises_judged) {
    return false;
  }
  const std::span<const double> last = surprises.last(surprises_judged);
  return std::accumulate(last.begin(), last.end(), 0.0) / static_cast<double>(last.size()) >=
         surprising_from;
}

/// Log-likelihood of one touch where its sensor is displaced.
class DisplacedTouch {
 public:
  DisplacedTouch(const TouchEvidence& touch, const Pose& T_object_robot, const InterpolatedMap& map,
                 const ContactModel& contact, std::size_t object)
      : T_object_sensor_(T_object_robot * touch.T_robot_sensor),
        map_(map),
        contact_(contact),
        object_(object),
        readings_(touch.readings),
        elements_mm_(touch.elements_mm) {}

  /// The displacement of largest likelihood, of the smaller ones where several are about as likely:
  /// a touch that feels little stays in its place.
  Pose best(double rad_per_mm) const {
    constexpr int reach = 4;           // steps of 1 mm; beyond, another part of the object may fit
    constexpr int turns = 2;           // steps of the turn that belongs to 2 mm
    constexpr double finest_mm = 0.1;  // no length is told more finely
    Pose best;
    double most = score(best, rad_per_mm, reach);
    const auto try_at = [&](const Pose& displacement) {
      const double one = score(displacement, rad_per_mm, reach);
      if (one > most) {
        most = one;
        best = displacement;
      }
    };
    for (int turn = -turns; turn <= turns; ++turn) {
      for (int y = -reach; y <= reach; ++y) {
        for (int x = -reach; x <= reach; ++x) {
          if (x * x + y * y <= reach * reach) {
            try_at({{x, y}, 2.0 * turn * rad_per_mm});
          }
        }
      }
    }
    for (double step = 0.5; step > finest_mm; step /= 2.0) {
      const Pose from = best;
      for (const double way : {-step, step}) {
        try_at({from.translation_mm + glm::dvec2(way, 0.0), from.theta_rad});
        try_at({from.translation_mm + glm::dvec2(0.0, way), from.theta_rad});
        try_at({from.translation_mm, from.theta_rad + 2.0 * way * rad_per_mm});
      }
    }
    return best;
  }

 private:
  double score(const Pose& displacement, double rad_per_mm, double reach_mm) const {
    const std::size_t levels = reading_levels(contact_);
    const std::vector<double> logs = reading_log_likelihoods(
        elements_mm_, T_object_sensor_ * displacement, map_, contact_, object_);
    double sum = 0.0;
    for (std::size_t e = 0; e < readings_.size(); ++e) {
      if (readings_[e] != Reading::unknown) {
        sum += logs[e * levels + static_cast<std::size_t>(readings_[e])];
      }
    }
    const double mm = glm::length(displacement.translation_mm) / reach_mm;
    const double turn = displacement.theta_rad / (rad_per_mm * reach_mm);
    return sum - 0.5 * (mm * mm + turn * turn);
  }

  Pose T_object_sensor_;
  const InterpolatedMap& map_;
  const ContactModel& contact_;
  std::size_t object_;
  std::span<const Reading> readings_;
  std::span<const glm::dvec2> elements_mm_;
};

}  // namespace

std::optional<std::string> touches_contradict(std::span<const TouchEvidence> touches,
                                              const RecognitionTask& task,
                                              const RecognitionStep& step,
                                              std::span<const double> surprises) {
  constexpr std::size_t most_touches = 12;   // the last of them; more would only take longer
  constexpr double usual_rad_per_mm = 0.05;  // a robot that is 1 mm off is some 3 degrees off
  const bool misfit = step.fit && step.fit->verdict != Verdict::fits;
  if (!step.refined || task.labels[step.best] == none_label || touches.size() < 2 ||
      !(misfit || are_surprising(surprises))) {
    return {};
  }
  const auto object = static_cast<std::size_t>(step.mode.object);
  const OccupancyGrid& map = task.hypotheses[object].compared();
  ContactModel contact = task.contact();
  contact.prior = contact.prior.value_or(map.prior);
  const InterpolatedMap interpolated(map, *contact.prior);
  const DisplacementSd sd = task.touch_sd();
  const double rad_per_mm = sd.mm > 0.0 && sd.rad > 0.0 ? sd.rad / sd.mm : usual_rad_per_mm;
  std::vector<TouchEvidence> displaced;
  double squares = 0.0;
  std::size_t in_contact = 0;
  for (const TouchEvidence& touch : touches.last(std::min(touches.size(), most_touches))) {
    displaced.push_back(touch);
    if (touch.in_contact()) {
      const Pose displacement =
          DisplacedTouch(touch, step.pose(), interpolated, contact, object).best(rad_per_mm);
      displaced.back().T_robot_sensor = touch.T_robot_sensor * displacement;
      squares += glm::dot(displacement.translation_mm, displacement.translation_mm);
      ++in_contact;
    }
  }
  if (in_contact < 2) {
    return {};
  }
  const Fit fit = evidence_fit(displaced, step.pose(), map, contact, object).value();
  if (task.fit_scale_for(touches).of(fit, in_contact).verdict != Verdict::fits) {
    return {};
  }
  return fmt::format(
      "the touches contradict each other by {:.1f} mm: is touch-sd too small, or did the object "
      "move?",
      std::sqrt(squares / static_cast<double>(in_contact)));
}

}  // namespace palpate
