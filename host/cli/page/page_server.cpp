#include "cli/page/page_server.hpp"

#include <arpa/inet.h>
#include <sys/socket.h>
#include <unistd.h>

#include <atomic>
#include <chrono>
#include <cstdlib>
#include <string_view>
#include <thread>

#include <fmt/format.h>
#include <CLI/CLI.hpp>

#include "cli/options.hpp"
#include "cli/page/limited_server.hpp"
#include "cli/page/page_feed.hpp"
#include "cli/page/site.hpp"
#include "model/option_words.hpp"

namespace palpate::cli {

namespace {

using namespace std::chrono_literals;

constexpr int most_pages = 16;     ///< that take events at a time
constexpr int other_requests = 4;  ///< threads that are left to answer while all of them look
constexpr std::size_t most_asked = 4096;  ///< bytes of a request's body

bool is_ip(const std::string& host) {
  unsigned char bytes[sizeof(in6_addr)];
  return inet_pton(AF_INET, host.c_str(), bytes) == 1 ||
         inet_pton(AF_INET6, host.c_str(), bytes) == 1;
}

/// The host of "host:port", without the brackets of an IPv6 address.
std::string without_port(const std::string& authority) {
  if (authority.starts_with('[')) {
    return authority.substr(1, authority.find(']') - 1);
  }
  return authority.substr(0, authority.find(':'));
}

/// Whether a request's Host names this machine and not a name of somebody else's that was made to
/// lead here: an address, localhost, or this machine's own name.
bool is_own(const std::string& authority) {
  const std::string host = without_port(authority);
  char name[256] = {};
  return is_ip(host) || host == "localhost" ||
         (gethostname(name, sizeof(name) - 1) == 0 && host == name);
}

bool may_read(const httplib::Request& request) {
  const std::string host = request.get_header_value("Host");
  if (request.get_header_value_count("Host") != 1 || !is_own(host)) {
    return false;
  }
  return !request.has_header("Origin") || request.get_header_value("Origin") == "http://" + host;
}

void answer(httplib::Response& response, int status, const std::string& words) {
  response.status = status;
  response.set_content(words + "\n", "text/plain; charset=utf-8");
}

/// The options of a listening socket: without SO_REUSEPORT, with which two programs would share a
/// port in silence.
void own_port_alone(int socket) {
  const int yes = 1;
  setsockopt(socket, SOL_SOCKET, SO_REUSEADDR, &yes, sizeof(yes));
}

std::string sent_text(const PageEvent& event) {
  return fmt::format("event: {}\ndata: {}\n\n", event.name, *event.data);
}

}  // namespace

void add_page_flags(CLI::App& command, PageAddress& address) {
  command
      .add_option_function<std::string>(
          "--page",
          [&address](const std::string& port) {
            address.port = port.empty() ? default_page_port : std::stoi(port);
          },
          "Serve a page for a browser at PORT of this machine, 8080 unless given; 0 takes a free "
          "port")
      ->expected(0, 1)
      ->type_name("PORT")
      ->check(CLI::Range(0, 65535));
  command
      .add_option(
          "--page-address", address.host,
          "Address at which the page is served; 0.0.0.0 shows it to everybody who can reach "
          "this machine, and lets them press its buttons")
      ->capture_default_str();
}

struct PageServer::Impl {
  PageAddress address;
  PageFeed& feed;
  PageAnswers answers;
  LimitedServer server;
  int port = 0;
  std::atomic<int> pages{0};
  std::thread thread;

  void give_events(httplib::Response& response) {
    if (pages.fetch_add(1) >= most_pages) {
      --pages;
      answer(response, 503, fmt::format("{} pages look already; close one", most_pages));
      return;
    }
    response.set_header("Cache-Control", "no-store");
    response.set_chunked_content_provider(
        "text/event-stream",
        [this, sent = std::uint64_t{0}, first = true](std::size_t,
                                                      httplib::DataSink& sink) mutable {
          // A page that comes back after a break forgets what it had.
          std::string text = first ? "retry: 1000\nevent: hello\ndata: {}\n\n" : "";
          first = false;
          for (const PageEvent& event : feed.after(sent, 10s)) {
            text += sent_text(event);
            sent = event.number;
          }
          if (feed.closed()) {
            sink.done();
            return true;
          }
          // Writing nothing would not tell that the page has gone.
          text = text.empty() ? ": still here\n\n" : text;
          return sink.write(text.data(), text.size());
        },
        [this](bool) { --pages; });
  }

  void act(const httplib::Request& request, httplib::Response& response) {
    try {
      const nlohmann::json asked = nlohmann::json::parse(request.body, nullptr, false);
      if (!asked.is_object()) {
        answer(response, 400, "a request is an object of JSON");
        return;
      }
      answers.act(asked);
      answer(response, 200, "done");
    } catch (const nlohmann::json::exception&) {
      answer(response, 400, "a request names what it asks for, with a number where one is needed");
    } catch (const Error& error) {
      answer(response, 409, in_flags(error.what()));
    }
  }

  void get(const httplib::Request& request, httplib::Response& response) {
    for (const auto& [path, type, bytes] : site) {
      if (request.path == path) {
        response.set_content(bytes.data(), bytes.size(), type);
        return;
      }
    }
    if (const std::optional<std::string> json = answers.get(request.path)) {
      response.set_content(*json, "application/json");
      return;
    }
    answer(response, 404, "nothing is here; the page is at /");
  }
};

PageServer::PageServer(const PageAddress& address, PageFeed& feed, PageAnswers answers,
                       const RequestLimits& limits)
    : impl_(new Impl{.address = address,
                     .feed = feed,
                     .answers = std::move(answers),
                     .server = {limits, most_pages + other_requests}}) {
  LimitedServer& server = impl_->server;
  server.set_socket_options(own_port_alone);
  server.set_tcp_nodelay(true);  // a body shall not wait 40 ms for the head's acknowledgement
  server.set_payload_max_length(most_asked);
  // The page loads nothing from elsewhere. Notebooks of this machine may hold it in a frame.
  server.set_default_headers(
      {{"Content-Security-Policy",
        "default-src 'self'; img-src 'self' data:; frame-ancestors 'self' http://localhost:* "
        "http://127.0.0.1:*"},
       {"X-Content-Type-Options", "nosniff"},
       {"Cross-Origin-Resource-Policy", "same-origin"}});
  server.set_pre_routing_handler([](const httplib::Request& request, httplib::Response& response) {
    if (may_read(request)) {
      return httplib::Server::HandlerResponse::Unhandled;
    }
    answer(response, 403, "this page is for its own host alone");
    return httplib::Server::HandlerResponse::Handled;
  });
  server.Get("/events", [this](const httplib::Request&, httplib::Response& response) {
    impl_->give_events(response);
  });
  server.Get(".*", [this](const httplib::Request& request, httplib::Response& response) {
    impl_->get(request, response);
  });
  server.Post("/do", [this](const httplib::Request& request, httplib::Response& response) {
    impl_->act(request, response);
  });
  const int asked = *address.port;
  impl_->port = asked == 0                                 ? server.bind_to_any_port(address.host)
                : server.bind_to_port(address.host, asked) ? asked
                                                           : -1;
  if (impl_->port < 0 && httplib::Server().bind_to_any_port(address.host) < 0) {
    refuse_flag("--page-address", address.host,
                "no page can be served there; give an address of this machine, such as 127.0.0.1, "
                "or 0.0.0.0 for all of them");
  }
  if (impl_->port < 0) {
    refuse_flag("--page", asked,
                "cannot be had at {}: another program may use it; give another port, or 0 for a "
                "free one",
                address.host);
  }
  impl_->thread = std::thread([this] { impl_->server.listen_after_bind(); });
}

PageServer::~PageServer() {
  impl_->feed.close();
  impl_->server.end();
  impl_->thread.join();
}

std::string PageServer::url() const {
  const std::string& host = impl_->address.host;
  const bool brackets = host.find(':') != std::string::npos;  // of IPv6
  return fmt::format("http://{}:{}/", brackets ? "[" + host + "]" : host, impl_->port);
}

std::string PageServer::words() const {
  const std::string& host = impl_->address.host;
  const bool alone = host.starts_with("127.") || host == "::1" || host == "localhost";
  return "the page is at " + url() +
         (alone ? std::getenv("SSH_CONNECTION") == nullptr
                      ? ""
                      : fmt::format("; from the machine before you, reach it through ssh -L "
                                    "{0}:127.0.0.1:{0}",
                                    impl_->port)
                : ", for everybody who can reach this machine: what the array feels, and the "
                  "buttons");
}

}  // namespace palpate::cli
