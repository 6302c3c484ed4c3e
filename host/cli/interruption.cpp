#include "cli/interruption.hpp"

namespace palpate::cli {

namespace {

constexpr int signals[] = {SIGINT, SIGHUP, SIGTERM};

volatile std::sig_atomic_t interrupted = 0;

}  // namespace

Interruption::Interruption() {
  interrupted = 0;
  struct sigaction action {};  // without SA_RESTART: a read that waits ends
  action.sa_handler = [](int) { interrupted = 1; };
  for (int i = 0; i < 3; ++i) {
    ::sigaction(signals[i], &action, &before_[i]);
    if (before_[i].sa_handler == SIG_IGN) {
      ::sigaction(signals[i], &before_[i], nullptr);  // nohup wants SIGHUP ignored
    }
  }
}

Interruption::~Interruption() {
  for (int i = 0; i < 3; ++i) {
    ::sigaction(signals[i], &before_[i], nullptr);
  }
}

bool Interruption::requested() const { return interrupted != 0; }

}  // namespace palpate::cli
