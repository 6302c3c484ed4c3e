#pragma once

#include "palpate/error.hpp"

namespace palpate {

/// Guards what is changed in several steps. Where an exception ends a change between two of them,
/// the object is neither as before nor as after: it then refuses to say anything until it is begun
/// anew.
class HalfDone {
 public:
  /// @param refusal that what was left half done is answered with; says how to begin anew
  explicit HalfDone(const char* refusal) : refusal_(refusal) {}

  /// Throws Error where a change was left half done.
  void refuse() const {
    if (half_done_) {
      throw Error(Fault::input, refusal_);
    }
  }
  /// Makes a change; what would refuse it has been looked at before.
  template <typename Steps>
  void change(const Steps& steps) {
    refuse();
    half_done_ = true;
    steps();
    half_done_ = false;
  }
  /// All was begun anew.
  void forget() { half_done_ = false; }

 private:
  const char* refusal_;
  bool half_done_ = false;
};

}  // namespace palpate
