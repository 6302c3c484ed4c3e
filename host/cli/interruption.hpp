#pragma once

#include <csignal>
#include <cstddef>
#include <iterator>

namespace palpate::cli {

/// During its lifetime, SIGINT (Ctrl-C), SIGHUP and SIGTERM do not end the program; requested()
/// tells whether one of them came. A signal that is ignored stays so. Only one object may exist at
/// a time.
class Interruption {
 public:
  Interruption() {
    requested_ = 0;
    struct sigaction action {};  // without SA_RESTART: a read that waits ends
    action.sa_handler = [](int) { requested_ = 1; };
    for (std::size_t i = 0; i < std::size(signals); ++i) {
      ::sigaction(signals[i], &action, &before_[i]);
      if (before_[i].sa_handler == SIG_IGN) {
        ::sigaction(signals[i], &before_[i], nullptr);  // nohup wants SIGHUP ignored
      }
    }
  }
  ~Interruption() {
    for (std::size_t i = 0; i < std::size(signals); ++i) {
      ::sigaction(signals[i], &before_[i], nullptr);
    }
  }
  Interruption(const Interruption&) = delete;
  Interruption& operator=(const Interruption&) = delete;

  bool requested() const { return requested_ != 0; }

 private:
  static constexpr int signals[] = {SIGINT, SIGHUP, SIGTERM};
  static inline volatile std::sig_atomic_t requested_ = 0;
  struct sigaction before_[std::size(signals)];
};

}  // namespace palpate::cli
