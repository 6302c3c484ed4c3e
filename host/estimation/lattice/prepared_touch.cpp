#include "estimation/lattice/prepared_touch.hpp"

#include <utility>

#include <fmt/format.h>

#include "model/log_message.hpp"
#include "palpate/error.hpp"

namespace palpate {

bool PreparedTouch::make_room(const DenseBelief& belief) {
  if (!log_likelihood_) {
    try {
      log_likelihood_.emplace(belief.uniform());
    } catch (const Error& error) {
      // Others on the device have taken what the plan counted on.
      log_message(LogLevel::warning, fmt::format("no touch is prepared: {}", error.what()));
      room_ = false;
    }
  }
  return room_;
}

void PreparedTouch::evaluate(ContactEvidence evidence, DenseLikelihood& likelihood) {
  evidence_.reset();
  log_likelihood_->clear();
  likelihood.accumulate(evidence, *log_likelihood_, {});
  evidence_ = std::move(evidence);
}

void PreparedTouch::accumulate(DenseBelief& belief,
                               const std::function<void(double)>& progress) const {
  belief.add(*log_likelihood_);
  stream_.run();
  if (progress) {
    progress(1.0);
  }
}

}  // namespace palpate
