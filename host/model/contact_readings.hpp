#pragma once

#include <vector>

#include "palpate/contact_model.hpp"

namespace palpate {

/// ContactModel::classify() in the memory of `reuse`, for a filter that allocates nothing in an
/// update.
std::vector<Reading> classify(const Touch& touch, const ContactModel& model,
                              std::vector<Reading> reuse);
/// ContactClassifier::classify() likewise.
std::vector<Reading> classify(const Touch& touch, const ContactClassifier& classifier,
                              std::vector<Reading> reuse);

}  // namespace palpate
