#pragma once

#include <csignal>

namespace palpate::cli {

/// During its lifetime, SIGINT (Ctrl-C), SIGHUP and SIGTERM do not end the program; requested()
/// tells whether one of them came. A signal that is ignored stays so. Only one object may exist at
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
