#include "cli/page/page_server.hpp"

#include <arpa/inet.h>
#include <poll.h>
#include <sys/eventfd.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cerrno>
#include <chrono>
#include <cstdlib>
#include <semaphore>
#include <thread>
#include <utility>

#include <fmt/format.h>
#include <httplib.h>
#include <CLI/CLI.hpp>

#include "cli/options.hpp"
#include "cli/page/site.hpp"
#include "model/option_words.hpp"

namespace palpate::cli {

namespace {

using namespace std::chrono_literals;
using Clock = std::chrono::steady_clock;

constexpr int most_pages = 16;     ///< that take events at a time
constexpr int other_requests = 4;  ///< threads that are left to answer while all of them look
constexpr std::size_t most_asked = 4096;      ///< bytes of a request's body
constexpr double least_bytes_per_s = 4096.0;  ///< that whoever reads an answer takes

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

/// A connection, which its one request may use within the limits.
class LimitedStream : public httplib::Stream {
 public:
  LimitedStream(socket_t socket, const RequestLimits& limits, int ended)
      : socket_(socket),
        ended_(ended),
        bytes_left_(limits.bytes),
        read_until_(Clock::now() + limits.reading),
        most_patience_(limits.writing) {}

  ssize_t read(char* bytes, std::size_t size) override {
    if (begin_ == end_ && !fill()) {
      return -1;
    }
    const std::size_t count = std::min({size, end_ - begin_, bytes_left_});
    std::copy_n(buffer_.begin() + begin_, count, bytes);
    begin_ += count;
    bytes_left_ -= count;
    return count > 0 || size == 0 ? static_cast<ssize_t>(count) : -1;
  }

  /// The client may make the server wait for limits.writing, and for longer as it takes bytes.
  ssize_t write(const char* bytes, std::size_t size) override {
    const Clock::time_point begin = Clock::now();
    if (!wait(POLLOUT, patience_)) {
      return -1;
    }
    const ssize_t count = ::send(socket_, bytes, size, MSG_NOSIGNAL | MSG_DONTWAIT);
    const std::chrono::duration<double> earned(static_cast<double>(count) / least_bytes_per_s);
    patience_ = std::min<Clock::duration>(
        most_patience_,
        patience_ - (Clock::now() - begin) + std::chrono::duration_cast<Clock::duration>(earned));
    return count;
  }

  bool is_readable() const override { return begin_ != end_ || wait(POLLIN, 0s); }
  bool is_writable() const override { return wait(POLLOUT, patience_); }
  void get_remote_ip_and_port(std::string&, int&) const override {}  // nothing asks for them
  void get_local_ip_and_port(std::string&, int&) const override {}
  socket_t socket() const override { return socket_; }

 private:
  /// Whether the socket is ready in time, and before the server ends.
  bool wait(short event, Clock::duration time) const {
    const Clock::time_point until = Clock::now() + time;
    std::array<pollfd, 2> ready{{{socket_, event, 0}, {ended_, POLLIN, 0}}};
    int count = 0;
    do {
      const auto left = std::chrono::ceil<std::chrono::milliseconds>(until - Clock::now());
      count = ::poll(ready.data(), ready.size(), static_cast<int>(std::max(left, 0ms).count()));
    } while (count < 0 && errno == EINTR);
    return count > 0 && ready[1].revents == 0;
  }

  bool fill() {
    if (!wait(POLLIN, read_until_ - Clock::now())) {
      return false;
    }
    const ssize_t count = ::recv(socket_, buffer_.data(), buffer_.size(), MSG_DONTWAIT);
    begin_ = 0;
    end_ = static_cast<std::size_t>(std::max<ssize_t>(count, 0));
    return count > 0;
  }

  const socket_t socket_;
  const int ended_;
  std::array<char, 4096> buffer_;
  std::size_t begin_ = 0;
  std::size_t end_ = 0;
  std::size_t bytes_left_;
  const Clock::time_point read_until_;
  const Clock::duration most_patience_;
  Clock::duration patience_ = most_patience_;
};

/// Threads for connections. Where many wait, the next are not accepted, so that they cannot take
/// all file descriptors of the program.
class Connections : public httplib::ThreadPool {
 public:
  Connections(int threads, int limit)
      : httplib::ThreadPool(static_cast<std::size_t>(threads)), room_(limit) {}

  void enqueue(std::function<void()> serve) override {
    room_.acquire();
    httplib::ThreadPool::enqueue([this, serve = std::move(serve)] {
      serve();
      room_.release();
    });
  }

 private:
  std::counting_semaphore<> room_;
};

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
  add_with_default(command, "--page-address", address.host,
                   "Address at which the page is served; 0.0.0.0 shows it to everybody who can "
                   "reach this machine, and lets them press its buttons");
}

/// httplib's server within RequestLimits: httplib itself limits each read's time but not a
/// request's, and neither a request's headers nor a body that comes in chunks or compressed.
struct PageServer::Impl : httplib::Server {
  PageAddress address;
  PageFeed feed;
  PageAnswers answers;
  RequestLimits limits;
  int port = 0;
  const int ended = ::eventfd(0, EFD_CLOEXEC);  ///< readable once the server ends
  std::atomic<int> pages{0};
  std::thread thread;

  Impl(const PageAddress& at, PageAnswers of_program, const RequestLimits& of_client)
      : address(at), answers(std::move(of_program)), limits(of_client) {
    if (ended < 0) {
      throw Error(Fault::system, "the page: no file descriptor is left; end other programs");
    }
    new_task_queue = [this] {
      return new Connections(most_pages + other_requests, limits.connections);
    };
  }
  ~Impl() override { ::close(ended); }

  /// Ends listen_after_bind(), whether it has begun or not, and waits for no client.
  void end() {
    ::eventfd_write(ended, 1);
    // Unlike stop(), also before the listening thread has begun.
    if (const socket_t listening = svr_sock_.exchange(INVALID_SOCKET);
        listening != INVALID_SOCKET) {
      ::shutdown(listening, SHUT_RDWR);
      ::close(listening);
    }
  }

  bool process_and_close_socket(socket_t socket) override {
    LimitedStream stream(socket, limits, ended);
    bool closed = false;
    // The only request of a connection: what is left of a body that nobody reads is no request.
    process_request(stream, true, closed, [](httplib::Request& request) {
      request.ranges.clear();                     // 2,650 ranges would be as many copies
      request.headers.erase("Content-Encoding");  // a body stays as small as it was sent
    });
    ::shutdown(socket, SHUT_RDWR);
    return ::close(socket) == 0;
  }

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
            text += fmt::format("event: {}\ndata: {}\n", event.name, *event.data);
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

PageServer::PageServer(const PageAddress& address, PageAnswers answers, const RequestLimits& limits)
    : impl_(new Impl(address, std::move(answers), limits)) {
  Impl& server = *impl_;
  server.set_socket_options(own_port_alone);
  server.set_tcp_nodelay(true);  // a body shall not wait 40 ms for the head's acknowledgement
  server.set_payload_max_length(most_asked);
  // The page loads nothing from elsewhere. Notebooks of this machine may hold it in a frame.
  server.set_default_headers({{"Content-Security-Policy",
                               "default-src 'self'; img-src 'self' data:; frame-ancestors 'self' "
                               "http://localhost:* http://127.0.0.1:*"},
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
    refuse_flag(
        "--page", asked,
        "cannot be had at {}: another program may use it; give another port, or 0 for a free one",
        address.host);
  }
  impl_->thread = std::thread([this] { impl_->listen_after_bind(); });
}

PageServer::~PageServer() {
  impl_->feed.close();
  impl_->end();
  impl_->thread.join();
}

PageFeed& PageServer::feed() { return impl_->feed; }

std::string PageServer::url() const {
  const std::string& host = impl_->address.host;
  const bool brackets = host.find(':') != std::string::npos;  // of IPv6
  return fmt::format("http://{}:{}/", brackets ? "[" + host + "]" : host, impl_->port);
}

std::string PageServer::words() const {
  const std::string& host = impl_->address.host;
  const bool this_host_only = host.starts_with("127.") || host == "::1" || host == "localhost";
  return "the page is at " + url() +
         (this_host_only
              ? std::getenv("SSH_CONNECTION") == nullptr
                    ? ""
                    : fmt::format("; from the machine before you, reach it through ssh -L "
                                  "{0}:127.0.0.1:{0}",
                                  impl_->port)
              : ", for everybody who can reach this machine: what the array feels, and the "
                "buttons");
}

}  // namespace palpate::cli
