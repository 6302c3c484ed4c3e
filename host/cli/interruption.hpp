#pragma once

#include <csignal>

namespace palpate::cli {

/// While it lives, Ctrl-C, a hang-up and SIGTERM do not end the program but are noted here. One at
/// a time.
class Interruption {
 public:
  Interruption();
  ~Interruption();
  Interruption(const Interruption&) = delete;
  Interruption& operator=(const Interruption&) = delete;

  bool requested() const;

 private:
  struct sigaction before_[3];
};

}  // namespace palpate::cli
