#pragma once

#include "palpate/error.hpp"

namespace palpate {

/// Remembers that an exception interrupted a change of several steps. The object then refuses every
/// call until it is reset.
class ChangeInSteps {
 public:
  /// @param refusal message of the Error; says how to reset the object
  explicit ChangeInSteps(const char* refusal) : refusal_(refusal) {}

  /// Throws Error where a change was interrupted.
  void refuse() const {
    if (changing_) {
      throw Error(Fault::input, refusal_);
    }
  }
  /// Runs `steps`, unless an earlier change was interrupted.
  template <typename Steps>
  void change(const Steps& steps) {
    refuse();
    changing_ = true;
    steps();
    changing_ = false;
  }
  /// The object was reset.
  void forget() { changing_ = false; }

 private:
  const char* refusal_;
  bool changing_ = false;
};

}  // namespace palpate
