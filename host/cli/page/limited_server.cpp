#include "cli/page/limited_server.hpp"

#include <poll.h>
#include <sys/eventfd.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <chrono>
#include <functional>
#include <semaphore>
#include <utility>

#include "palpate/error.hpp"

namespace palpate::cli {

namespace {

using namespace std::chrono_literals;
using Clock = std::chrono::steady_clock;

constexpr int most_requests = 100;            ///< of a connection
constexpr double least_bytes_per_s = 4096.0;  ///< that whoever reads an answer takes

/// A connection, which a request may use within the limits.
class LimitedStream : public httplib::Stream {
 public:
  LimitedStream(socket_t socket, const RequestLimits& limits, int ended)
      : socket_(socket), limits_(limits), ended_(ended) {}

  /// Waits for a request's first byte; false where none comes.
  bool begin() {
    if (begin_ == end_ && !fill(limits_.idle)) {
      return false;
    }
    bytes_left_ = limits_.bytes;
    read_until_ = Clock::now() + limits_.reading;
    patience_ = limits_.writing;
    return true;
  }

  ssize_t read(char* bytes, std::size_t size) override {
    if (begin_ == end_ && !fill(read_until_ - Clock::now())) {
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
        limits_.writing,
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

  bool fill(Clock::duration time) {
    if (!wait(POLLIN, time)) {
      return false;
    }
    const ssize_t count = ::recv(socket_, buffer_.data(), buffer_.size(), MSG_DONTWAIT);
    begin_ = 0;
    end_ = static_cast<std::size_t>(std::max<ssize_t>(count, 0));
    return count > 0;
  }

  const socket_t socket_;
  const RequestLimits& limits_;
  const int ended_;
  std::array<char, 4096> buffer_;
  std::size_t begin_ = 0;
  std::size_t end_ = 0;
  std::size_t bytes_left_ = 0;
  Clock::time_point read_until_;
  Clock::duration patience_{};
};

}  // namespace

/// Threads for connections. Where many wait, the next are not accepted, so that they cannot take
/// all file descriptors of the program.
class LimitedServer::Connections : public httplib::ThreadPool {
 public:
  Connections(int threads, int most)
      : httplib::ThreadPool(static_cast<std::size_t>(threads)), room_(most) {}

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

LimitedServer::LimitedServer(const RequestLimits& limits, int threads)
    : limits_(limits), ended_(::eventfd(0, EFD_CLOEXEC)) {
  if (ended_ < 0) {
    throw Error(Fault::system, "the page: no file descriptor is left; end other programs");
  }
  new_task_queue = [threads, most = limits.connections] { return new Connections(threads, most); };
}

LimitedServer::~LimitedServer() { ::close(ended_); }

void LimitedServer::end() {
  ::eventfd_write(ended_, 1);
  // Unlike stop(), also before the listening thread has begun.
  if (const socket_t listening = svr_sock_.exchange(INVALID_SOCKET); listening != INVALID_SOCKET) {
    ::shutdown(listening, SHUT_RDWR);
    ::close(listening);
  }
}

bool LimitedServer::process_and_close_socket(socket_t socket) {
  LimitedStream stream(socket, limits_, ended_);
  bool more = true;
  for (int left = most_requests; more && left > 0 && stream.begin(); --left) {
    more = false;
    bool closed = false;
    const bool answered =
        process_request(stream, left == 1, closed, [&more](httplib::Request& request) {
          request.ranges.clear();                     // 2,650 ranges would be as many copies
          request.headers.erase("Content-Encoding");  // a body stays as small as it was sent
          // What is left of a body that nobody reads shall not be taken for the next request.
          more = request.method == "GET" && !request.has_header("Content-Length") &&
                 !request.has_header("Transfer-Encoding");
          if (!more) {
            request.headers.erase("Connection");
            request.set_header("Connection", "close");
          }
        });
    more = more && answered && !closed;
  }
  ::shutdown(socket, SHUT_RDWR);
  return ::close(socket) == 0;
}

}  // namespace palpate::cli
