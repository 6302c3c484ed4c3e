#include "gpu/pipelines.hpp"

#include <algorithm>
#include <cstddef>

namespace palpate::gpu {

namespace {

/// Several filters of all kinds have as many; a program that makes ever other ones keeps no more.
constexpr std::size_t most_kept = 64;

bool same(const KernelInfo& a, const KernelInfo& b) {
  return a.spirv.data() == b.spirv.data() && a.bindings == b.bindings &&
         a.push_bytes == b.push_bytes && a.constants == b.constants;
}

}  // namespace

std::shared_ptr<const Pipeline> Pipelines::get(const KernelInfo& info,
                                               const std::function<Pipeline()>& make) {
  // Whoever needs the same one at the same time waits for it.
  const std::scoped_lock lock(mutex_);
  const auto found = std::ranges::find_if(
      of_late_, [&](const auto& pipeline) { return same(pipeline->info, info); });
  if (found != of_late_.end()) {
    of_late_.splice(of_late_.begin(), of_late_, found);
  } else {
    of_late_.push_front(std::make_shared<const Pipeline>(make()));
    of_late_.resize(std::min(of_late_.size(), most_kept));
  }
  return of_late_.front();
}

void Pipelines::clear() { of_late_.clear(); }

}  // namespace palpate::gpu
