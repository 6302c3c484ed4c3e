#pragma once

#include <string>
#include <vector>

#include "learning/press.hpp"
#include "palpate/contact.hpp"

namespace palpate {

/// @throws Error where some presses are at known poses and others are not
void require_poses_of_one_kind(const std::vector<Press>& presses);

/// Removes presses all of whose elements are Unknown, and warns of them in a sentence.
/// @throws Error where no press is left
std::vector<std::string> leave_out_unknown(std::vector<Press>& presses,
                                           const ContactClassifier& classifier);

/// Warns of elements that seem stuck: of arrays that touched five times or more, they read the very
/// same pressure above the threshold each time, which hardly any other reading In Contact equals.
/// Whole sentences; none where all is well.
std::vector<std::string> stuck_elements(const std::vector<Press>& presses,
                                        const ContactClassifier& classifier);

}  // namespace palpate
