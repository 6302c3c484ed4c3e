#pragma once

#include "palpate/error.hpp"

namespace palpate {

/// Remembers that an exception interrupted a change of several steps. The object then refuses every
/// call until it is reset.
class HalfDone {
 public:
  /// @param refusal message of the Error; says how to reset the object
  explicit HalfDone(const char* refusal) : refusal_(refusal) {}

  /// Throws Error where a change was interrupted.
  void refuse() const {
    if (half_done_) {
      throw Error(Fault::input, refusal_);
    }
  }
  /// Runs `steps`, unless an earlier change was interrupted.
  template <typename Steps>
  void change(const Steps& steps) {
    refuse();
    half_done_ = true;
    steps();
    half_done_ = false;
  }
  /// The object was reset.
  void forget() { half_done_ = false; }

 private:
  const char* refusal_;
  bool half_done_ = false;
};

}  // namespace palpate
