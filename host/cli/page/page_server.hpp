#pragma once

#include <chrono>
#include <cstddef>
#include <functional>
#include <memory>
#include <optional>
#include <string>

#include <nlohmann/json.hpp>

#include "cli/page/page_feed.hpp"

namespace CLI {
class App;
}

namespace palpate::cli {

inline constexpr int default_page_port = 8080;
/// Where a page is served.
struct PageAddress {
  std::string host = "127.0.0.1";
  std::optional<int> port;  ///< none: no page
};
/// Adds --page and --page-address.
void add_page_flags(CLI::App& command, PageAddress& address);

/// What a page may ask for besides its events.
struct PageAnswers {
  /// The JSON behind a path, such as "/map/0"; none where there is nothing.
  std::function<std::optional<std::string>(const std::string& path)> get;
  /// Does what a button asks for. Throws Error where that cannot be done.
  std::function<void(const nlohmann::json& request)> act;
};

/// What one client may take of the server. A client that takes more is hung up on.
struct RequestLimits {
  std::size_t bytes = 16384;                ///< of a request: its head and its body
  std::chrono::milliseconds reading{2000};  ///< until the whole request is there
  std::chrono::milliseconds writing{5000};  ///< that a client stops taking the answer
  int connections = 64;                     ///< that are served or wait; others are not accepted
};

/// Serves Palpate's page over HTTP from construction on: its files, the events of its feed
/// (as server-sent events, to 16 pages at a time), and `answers`. Answers are given on threads of
/// the server's own. Requests for another host than this one, or from a page of another site, get
/// 403, so that no other site reads what the robot feels.
class PageServer {
 public:
  /// @throws Error where the address is none of this machine's, or the port cannot be had
  PageServer(const PageAddress& address, PageAnswers answers, const RequestLimits& limits = {});
  /// Ends all connections, whatever their clients do.
  ~PageServer();
  PageServer(const PageServer&) = delete;
  PageServer& operator=(const PageServer&) = delete;

  PageFeed& feed();
  /// "http://127.0.0.1:8080/"
  std::string url() const;
  /// The sentence that tells where the page is, and what it exposes where others can reach it.
  std::string words() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace palpate::cli
