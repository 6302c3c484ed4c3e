#include "pose_reader.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <poll.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cmath>
#include <cstring>

#include <nlohmann/json.hpp>

#include "palpate/error.hpp"

namespace palpate {

namespace {

// The descriptor of a file, never one of standard input, output and error: a daemon may have closed
// those, and the number 0 stands for poses from standard input here.
int open_poses(const std::string& path) {
  // Without waiting for whoever writes to a FIFO.
  const int descriptor = ::open(path.c_str(), O_RDONLY | O_NONBLOCK | O_CLOEXEC);
  if (descriptor < 0 || descriptor > STDERR_FILENO) {
    return descriptor;
  }
  const int moved = ::fcntl(descriptor, F_DUPFD_CLOEXEC, STDERR_FILENO + 1);
  ::close(descriptor);
  return moved;
}

// Far longer than any pose; what never ends a line must not fill the memory.
constexpr std::size_t longest_line = 4096;

std::optional<double> number(const nlohmann::json& line, const char* key) {
  const auto found = line.find(key);
  if (found == line.end() || !found->is_number()) {
    return {};
  }
  const double value = found->get<double>();
  return std::isfinite(value) ? std::optional(value) : std::nullopt;
}

}  // namespace

PoseReader::PoseReader(const std::string& name, PoseTrack& track)
    : name_(name == "-" ? "standard input" : name), track_(track) {
  descriptor_ = name == "-" ? STDIN_FILENO : open_poses(name);
  struct stat status {};
  if (descriptor_ < 0 || ::fstat(descriptor_, &status) != 0) {
    throw Error(Fault::input, fmt::format("poses {}: cannot be read: {}; give a file, a FIFO or "
                                          "- for standard input",
                                          name, std::strerror(errno)));
  }
  if (S_ISDIR(status.st_mode)) {
    ::close(descriptor_);
    throw Error(Fault::input, fmt::format("poses {}: is a folder; name a file in it", name));
  }
  is_file_ = S_ISREG(status.st_mode);
  is_fifo_ = S_ISFIFO(status.st_mode) && descriptor_ != STDIN_FILENO;
  if (is_file_) {
    try {
      read();
    } catch (...) {
      ::close(descriptor_);  // no destructor runs
      throw;
    }
  }
}

PoseReader::~PoseReader() {
  if (descriptor_ != STDIN_FILENO) {
    ::close(descriptor_);
  }
}

void PoseReader::read() {
  char bytes[1 << 14];
  while (!ended_) {
    pollfd ready{.fd = descriptor_, .events = POLLIN, .revents = 0};
    if (::poll(&ready, 1, 0) <= 0) {
      return;
    }
    const ssize_t got = ::read(descriptor_, bytes, sizeof bytes);
    if (got > 0) {
      take({bytes, static_cast<std::size_t>(got)});
    } else if (got < 0 || is_fifo_) {
      return;  // nothing there yet, or another writer may come
    } else {
      ended_ = true;
      end_line();
    }
  }
}

void PoseReader::take(std::string_view bytes) {
  while (!bytes.empty()) {
    const std::size_t end = bytes.find('\n');
    const std::string_view part = bytes.substr(0, end);
    if (line_.size() + part.size() > longest_line) {
      overlong_ = true;
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

void PoseReader::end_line() {
  ++lines_;
  const std::string text = std::exchange(line_, {});
  if (std::exchange(overlong_, false)) {
    refuse_line("is longer than any pose");
    return;
  }
  if (text.find_first_not_of(" \t\r") == std::string::npos) {
    return;
  }
  const nlohmann::json line = nlohmann::json::parse(text, nullptr, false);
  if (!line.is_object()) {
    refuse_line("is no JSON object");
    return;
  }
  const auto time = number(line, "time");
  const auto x = number(line, "x_mm");
  const auto y = number(line, "y_mm");
  const auto theta = number(line, "theta_rad");
  if (!time || !x || !y || !theta) {
    refuse_line(fmt::format("has no number '{}'", !time ? "time"
                                                  : !x  ? "x_mm"
                                                  : !y  ? "y_mm"
                                                        : "theta_rad"));
    return;
  }
  if (!track_.add(*time, {{*x, *y}, *theta})) {
    refuse_line("is not later than the pose before");
    return;
  }
  ++poses_;
}

void PoseReader::refuse_line(std::string_view problem) {
  ++refused_;
  const std::string text = fmt::format(
      "{}, line {}: {}; write {{\"time\": s, \"x_mm\": mm, \"y_mm\": mm, \"theta_rad\": rad}}",
      name_, lines_, problem);
  if (is_file_) {
    throw Error(Fault::input, text);
  }
  if (first_refused_.empty()) {
    first_refused_ = text;
  }
}

}  // namespace palpate
