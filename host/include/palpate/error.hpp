#pragma once

#include <algorithm>
#include <stdexcept>
#include <string>
#include <utility>

#include "palpate/api.hpp"

namespace palpate {

/// What has to change for the call to succeed.
enum class Fault {
  input,   ///< a file, a value or an option given by the caller
  system,  ///< the machine: no device, out of memory, disk full, device lost
};

/// The one exception type that Palpate throws, from construction and I/O. The message is a single
/// line that names the file, the field, the value and the remedy as far as they are known.
class PALPATE_API Error : public std::runtime_error {
 public:
  Error(Fault fault, std::string message)
      : std::runtime_error(one_line(std::move(message))), fault_(fault) {}
  Fault fault() const noexcept { return fault_; }

 private:
  static std::string one_line(std::string text) {
    std::ranges::replace(text, '\n', ' ');
    return text;
  }

  Fault fault_;
};

}  // namespace palpate
