#include "io/available_memory.hpp"

#include <fmt/format.h>
#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <charconv>
#include <string>

#include "io/descriptor.hpp"
#include "palpate/error.hpp"

namespace palpate {

namespace {

constexpr std::uint64_t kib = 1024;

/// Returns the beginning of a kernel file; "" where it does not exist.
std::string text_of(const char* path) {
  const Descriptor file(path, O_RDONLY);
  std::string text(8192, '\0');
  const ssize_t size = file.valid() ? ::read(file.get(), text.data(), text.size()) : 0;
  text.resize(static_cast<std::size_t>(std::max<ssize_t>(size, 0)));
  return text;
}

/// Returns the whole number after `key` and blanks.
std::optional<std::uint64_t> number_after(const std::string& text, std::string_view key) {
  const std::size_t found = text.find(key);
  if (found == text.npos) {
    return {};
  }
  const std::size_t digits = text.find_first_not_of(" \t", found + key.size());
  std::uint64_t number = 0;
  const char* const end = text.data() + text.size();
  const char* const begin = text.data() + std::min(digits, text.size());
  return std::from_chars(begin, end, number).ec == std::errc{} ? std::optional(number)
                                                               : std::nullopt;
}

std::uint64_t left_of(std::uint64_t most, std::uint64_t used) {
  return most > used ? most - used : 0;
}

/// Memory of the machine: what it gives without swapping, and its free swap.
std::uint64_t machine_bytes() {
  const std::string text = text_of("/proc/meminfo");
  const auto available = number_after(text, "MemAvailable:");
  const auto swap = number_after(text, "SwapFree:");
  return available ? (*available + swap.value_or(0)) * kib : UINT64_MAX;
}

/// Memory that the control group leaves, as a container sees its own (versions 2 and 1).
std::uint64_t control_group_bytes() {
  constexpr const char* files[][3] = {
      {"/sys/fs/cgroup/memory.max", "/sys/fs/cgroup/memory.current", "/sys/fs/cgroup/memory.stat"},
      {"/sys/fs/cgroup/memory/memory.limit_in_bytes", "/sys/fs/cgroup/memory/memory.usage_in_bytes",
       "/sys/fs/cgroup/memory/memory.stat"}};
  for (const auto& [most_file, used_file, stat_file] : files) {
    const auto most = number_after(text_of(most_file), "");
    const auto used = number_after(text_of(used_file), "");
    if (most && used) {
      // Cached file pages count as used, but the kernel gives them up.
      const auto files_held = number_after(text_of(stat_file), "inactive_file ");
      return left_of(*most, left_of(*used, files_held.value_or(0)));
    }
  }
  return UINT64_MAX;
}

std::optional<std::uint64_t> status_bytes(const char* key) {
  const auto held = number_after(text_of("/proc/self/status"), key);
  return held ? std::optional(*held * kib) : std::nullopt;
}

/// Memory that a limit of this process leaves; the field of its status says how much is used.
std::uint64_t limit_bytes(__rlimit_resource resource, const char* status_key) {
  rlimit present{};
  if (::getrlimit(resource, &present) != 0 || present.rlim_cur == RLIM_INFINITY) {
    return UINT64_MAX;
  }
  return left_of(present.rlim_cur, status_bytes(status_key).value_or(0));
}

}  // namespace

std::uint64_t available_memory_bytes() {
  return std::min({machine_bytes(), control_group_bytes(), limit_bytes(RLIMIT_AS, "VmSize:"),
                   limit_bytes(RLIMIT_DATA, "VmData:")});
}

std::optional<std::uint64_t> data_bytes() { return status_bytes("VmData:"); }

std::uint64_t stored_bytes(std::span<const std::uint64_t> shape, std::uint64_t width) {
  std::uint64_t bytes = width;
  for (const std::uint64_t extent : shape) {
    if (__builtin_mul_overflow(bytes, extent, &bytes)) {
      return UINT64_MAX;
    }
  }
  return bytes;
}

void require_memory(const std::filesystem::path& path, std::string_view what, std::uint64_t bytes) {
  constexpr std::uint64_t small = 1 << 20;
  if (bytes <= small) {
    return;
  }
  if (const std::uint64_t available = available_memory_bytes(); bytes > available) {
    throw Error(
        Fault::system,
        fmt::format("{}: {} needs {:.1f} GB of memory, of which {:.1f} GB are available; end "
                    "other programs or use a larger machine",
                    path.string(), what, static_cast<double>(bytes) * 1e-9,
                    static_cast<double>(available) * 1e-9));
  }
}

}  // namespace palpate
