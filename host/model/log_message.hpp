#pragma once

#include <string>

#include "palpate/log.hpp"

namespace palpate {

/// Sends a message to the callback of set_log(), if there is one. Any thread may call it.
void log_message(LogLevel level, const std::string& message) noexcept;

}  // namespace palpate
