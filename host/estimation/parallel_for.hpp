#pragma once

#include <cstddef>

#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>

namespace palpate {

/// Calls body(i) for every i below `count`, on the threads of the task arena that it is called in.
/// A single thread makes no tasks: these take as long as small loops do.
template <typename Body>
void parallel_for(std::size_t count, const Body& body) {
  if (tbb::this_task_arena::max_concurrency() > 1) {
    tbb::parallel_for(std::size_t{0}, count, body);
    return;
  }
  for (std::size_t i = 0; i < count; ++i) {
    body(i);
  }
}

}  // namespace palpate
