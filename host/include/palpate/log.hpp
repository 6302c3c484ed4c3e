#pragma once

#include <functional>
#include <string>

#include "palpate/api.hpp"

namespace palpate {

enum class LogLevel {
  info,     ///< which device was chosen, and why
  warning,  ///< the result is right, but takes longer than it should
  error,    ///< what a destructor, which cannot throw, failed to do
};

using LogCallback = std::function<void(LogLevel level, const std::string& message)>;

/// Sends the library's messages to `log`, each a single line without a line break, from all threads
/// of the process, one at a time. The library prints nothing; without a callback, as at first,
/// messages are dropped. The callback must neither throw nor call Palpate.
PALPATE_API void set_log(LogCallback log);

}  // namespace palpate
