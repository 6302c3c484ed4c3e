#pragma once

#include <gtest/gtest.h>

#include <initializer_list>
#include <string>

#include "palpate/error.hpp"

namespace palpate {

/// The message of the Error that `action` throws, which must be one line and of this fault.
template <class Action>
std::string error_of(Fault fault, const Action& action) {
  try {
    action();
  } catch (const Error& error) {
    EXPECT_EQ(error.fault(), fault) << error.what();
    EXPECT_EQ(std::string(error.what()).find('\n'), std::string::npos) << error.what();
    return error.what();
  }
  ADD_FAILURE() << "nothing was thrown";
  return "";
}

/// The message of the input Error that `action` throws.
template <class Action>
std::string input_error(const Action& action) {
  return error_of(Fault::input, action);
}

/// Expects that a message names every one of these.
inline void expect_named(const std::string& message, std::initializer_list<const char*> parts) {
  for (const char* part : parts) {
    EXPECT_NE(message.find(part), std::string::npos) << "'" << part << "' not in: " << message;
  }
}

}  // namespace palpate
