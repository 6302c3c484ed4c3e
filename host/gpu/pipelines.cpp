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
  const auto found =
      std::ranges::find_if(kept_, [&](const auto& pipeline) { return same(pipeline->info, info); });
  if (found != kept_.end()) {
    kept_.splice(kept_.begin(), kept_, found);
  } else {
    kept_.push_front(std::make_shared<const Pipeline>(make()));
    kept_.resize(std::min(kept_.size(), most_kept));
  }
  return kept_.front();
}

void Pipelines::clear() { kept_.clear(); }

}  // namespace palpate::gpu
