#pragma once

#include <cstddef>
#include <vector>

#include "palpate/contact_model.hpp"

namespace palpate {

/// ContactModel::classify() in the memory of `reuse`, for a filter that allocates nothing in an
/// update.
std::vector<Reading> classify(const Touch& touch, const ContactModel& model,
                              std::vector<Reading> reuse);

/// @throws Error: a table of so many levels and sets of numbers has none for this reading or object
[[noreturn]] void refuse_reading(std::size_t levels, std::size_t sets, Reading reading,
                                 std::size_t object);

/// A model without a table as one with Eq. 7 in a table, which is read several times faster: within
/// 1e-4 nats of Eq. 7, unless gamma is so small that log odds beyond +-16 matter. A model with a
/// table as it is.
/// @param contact with a prior
ContactModel tabulated(ContactModel contact);

/// A model that gives every reading but Unknown its log-probability, log P(r | l) / sum over all r'
/// of P(r' | l), in a table: within 2e-4 nats of Eq. 7, log odds beyond +-16 as at +-16.
/// @param contact with a prior
ContactModel predictive(ContactModel contact);

}  // namespace palpate
