#pragma once

#include <memory>

#include <fmt/format.h>

#include "palpate/error.hpp"

namespace palpate {

/// Returns what an object of a public class holds. Throws Error, naming the class, where the object
/// was moved from.
template <typename T>
T& held_by(const std::unique_ptr<T>& held, const char* name) {
  if (!held) {
    throw Error(Fault::input,
                fmt::format("{}: was moved from; use the object that it was moved to", name));
  }
  return *held;
}

}  // namespace palpate
