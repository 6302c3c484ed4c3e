#pragma once

#include <memory>

#include <fmt/format.h>

#include "palpate/error.hpp"

namespace palpate {

/// Returns what an object of a public class holds. Throws Error, naming the class, where the object
/// was moved from.
template <typename T, typename Deleter>
T& held_by(const std::unique_ptr<T, Deleter>& held, const char* name) {
  if (!held) {
    throw Error(Fault::input,
                fmt::format("{}: was moved from; use the object that it was moved to", name));
  }
  return *held;
}

/// The process that an object was made in. A child of fork() has a copy of the object, but not the
/// threads that work for it, and cannot use the device that its parent has opened.
class OwnProcess {
 public:
  OwnProcess();

  /// False in a child of the process, and in the child's children.
  bool is_here() const;
  /// @throws Error in such a child, naming the object
  void require(const char* name) const;

 private:
  unsigned forks_;
};

/// As held_by(), of an object with a `process`. Throws Error in a child of it, too.
template <typename T, typename Deleter>
T& held_here(const std::unique_ptr<T, Deleter>& held, const char* name) {
  T& object = held_by(held, name);
  object.process.require(name);
  return object;
}

/// Destroys an object with a `process`. A child of its process leaves it as it is: its destructors
/// would wait for the parent's threads.
template <typename T>
void delete_here(T* object) {
  if (object->process.is_here()) {
    delete object;
  }
}

}  // namespace palpate
