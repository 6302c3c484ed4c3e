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

/// A model without a table as one with Eq. 7 in a table, which is read several times faster: within
/// 1e-4 nats of Eq. 7, unless gamma is so small that log odds beyond +-16 matter. A model with a
/// table as it is.
/// @param contact with a prior
ContactModel tabulated(ContactModel contact);

}  // namespace palpate
