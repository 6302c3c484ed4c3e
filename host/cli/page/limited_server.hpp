#pragma once

#include <httplib.h>

#include "cli/page/page_server.hpp"

namespace palpate::cli {

/// httplib's server within RequestLimits: httplib itself limits each read's time but not a
/// request's, and neither a request's headers nor a body that comes in chunks or compressed.
class LimitedServer : public httplib::Server {
 public:
  /// @param threads how many connections are served at a time; more wait
  LimitedServer(const RequestLimits& limits, int threads);
  ~LimitedServer() override;

  /// Ends listen_after_bind(), whether it has begun or not, and waits for no client.
  void end();

 private:
  class Connections;

  bool process_and_close_socket(socket_t socket) override;

  RequestLimits limits_;
  int ended_;  ///< an eventfd; readable once the server ends
};

}  // namespace palpate::cli
