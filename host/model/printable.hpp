#pragma once

#include <string>
#include <string_view>

namespace palpate {

/// The text with every control character and every byte that is not part of well-formed UTF-8
/// replaced by '?': Cairo draws nothing any more once it has met a malformed string, files refuse
/// it, and names of files and boards may hold any bytes.
std::string printable(std::string_view text);

}  // namespace palpate
