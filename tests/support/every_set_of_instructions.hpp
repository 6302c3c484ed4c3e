#pragma once

#include <functional>
#include <string>

namespace palpate {

/// Calls `test` with each set of vector instructions that this processor has and that the kernels
/// are compiled for, from the plainest, without vectors, to the processor's own; names the set.
/// Leaves the processor's own in use.
void with_every_set_of_instructions(const std::function<void(const std::string&)>& test);

}  // namespace palpate
