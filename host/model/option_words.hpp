#pragma once

#include <string>
#include <string_view>

namespace palpate {

// The library's messages name an option in backticks, alone or with a value: `bins`,
// `filter bounded`, `x-mm=-5:5`. Each face says it in its own words.

/// In flags of the command: --bins, --filter bounded, --x-mm=-5:5.
std::string in_flags(std::string_view message);

/// In keyword arguments of Python: bins=, filter='bounded', x_mm=(-5, 5); bins before a colon.
std::string in_keywords(std::string_view message);

using OptionWords = std::string (*)(std::string_view message);

}  // namespace palpate
