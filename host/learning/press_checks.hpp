#pragma once

#include <string>
#include <vector>

#include "palpate/contact.hpp"
#include "press.hpp"

namespace palpate {

/// @throws Error where some presses are at known poses and others are not, or a press has no living
/// element
void require_sound(const std::vector<Press>& presses);

/// Warns of elements that seem stuck: of arrays that touched five times or more, they read the very
/// same pressure above the threshold each time, which hardly any other reading In Contact equals.
/// Whole sentences; none where all is well.
std::vector<std::string> stuck_elements(const std::vector<Press>& presses,
                                        const ContactClassifier& classifier);

}  // namespace palpate
