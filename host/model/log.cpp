#include "palpate/log.hpp"

#include <mutex>
#include <utility>

#include "model/log_message.hpp"

namespace palpate {

namespace {

/// The callback of the process. It is never destroyed: static objects' destructors may still log.
struct Callback {
  std::mutex mutex;
  LogCallback call;
};

Callback& callback() {
  static auto* const callback = new Callback;
  return *callback;
}

}  // namespace

void set_log(LogCallback log) {
  const std::scoped_lock lock(callback().mutex);
  callback().call = std::move(log);
}

void log_message(LogLevel level, const std::string& message) noexcept {
  const std::scoped_lock lock(callback().mutex);
  if (callback().call) {
    callback().call(level, message);
  }
}

}  // namespace palpate
