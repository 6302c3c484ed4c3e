#include "streaming/line_reader.hpp"

#include <cerrno>
#include <cstring>
#include <utility>

#include <fmt/format.h>
#include <poll.h>
#include <sys/stat.h>
#include <unistd.h>

#include "palpate/error.hpp"

namespace palpate {

LineReader::LineReader(std::string kind, const std::string& name, std::size_t longest,
                       std::function<void(const Line&)> take)
    : kind_(std::move(kind)),
      name_(name == "-" ? "standard input" : name),
      longest_(longest),
      take_(std::move(take)) {
  if (name != "-") {
    file_ = Descriptor(name, O_RDONLY | O_NONBLOCK);  // not waiting for the writer of a FIFO
  }
  descriptor_ = name == "-" ? STDIN_FILENO : file_.get();
  struct stat status {};
  if (descriptor_ < 0 || ::fstat(descriptor_, &status) != 0) {
    throw Error(Fault::input, fmt::format("{} {}: cannot be read: {}; give a file, a FIFO or - for "
                                          "standard input",
                                          kind_, name, std::strerror(errno)));
  }
  if (S_ISDIR(status.st_mode)) {
    throw Error(Fault::input, fmt::format("{} {}: is a folder; name a file in it", kind_, name));
  }
  is_file_ = S_ISREG(status.st_mode);
  is_fifo_ = S_ISFIFO(status.st_mode) && descriptor_ != STDIN_FILENO;
}

bool LineReader::read_some(std::chrono::milliseconds wait) {
  char bytes[1 << 14];
  pollfd ready{.fd = descriptor_, .events = POLLIN, .revents = 0};
  if (ended_ || (!is_file_ && ::poll(&ready, 1, static_cast<int>(wait.count())) <= 0)) {
    return false;
  }
  const ssize_t got = ::read(descriptor_, bytes, sizeof bytes);
  if (got > 0) {
    take({bytes, static_cast<std::size_t>(got)});
    return true;
  }
  if (got < 0 && is_file_) {
    throw Error(Fault::input, fmt::format("{} {}: cannot be read: {}; copy or record it again",
                                          kind_, name_, std::strerror(errno)));
  }
  if (got == 0 && !is_fifo_) {
    ended_ = true;
    if (!line_.empty() || too_long_) {
      end_line();
    }
  }
  return false;
}

void LineReader::take(std::string_view bytes) {
  while (!bytes.empty()) {
    const std::size_t end = bytes.find('\n');
    const std::string_view part = bytes.substr(0, end);
    if (line_.size() + part.size() > longest_) {
      too_long_ = true;
    } else {
      line_ += part;
    }
    if (end == std::string_view::npos) {
      return;
    }
    end_line();
    bytes.remove_prefix(end + 1);
  }
}

void LineReader::end_line() {
  ++lines_;
  const std::string text = std::exchange(line_, {});
  if (std::exchange(too_long_, false)) {
    take_({.number = lines_, .text = {}, .too_long = true});
  } else if (text.find_first_not_of(" \t\r") != std::string::npos) {
    take_({.number = lines_, .text = text});
  }
}

}  // namespace palpate
