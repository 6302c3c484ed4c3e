#include "cli/interruption.hpp"

#include <csignal>
#include <initializer_list>

namespace palpate::cli {

namespace {

volatile std::sig_atomic_t signal_came = 0;

}  // namespace

void catch_interruptions() {
  struct sigaction action {};  // without SA_RESTART: a read that waits ends
  action.sa_handler = [](int) { signal_came = 1; };
  for (const int signal : {SIGINT, SIGHUP, SIGTERM}) {
    struct sigaction before {};
    ::sigaction(signal, nullptr, &before);
    if (before.sa_handler != SIG_IGN) {  // nohup wants SIGHUP ignored
      ::sigaction(signal, &action, nullptr);
    }
  }
}

bool interrupted() { return signal_came != 0; }

}  // namespace palpate::cli
