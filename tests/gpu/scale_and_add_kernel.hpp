#pragma once

#include <cstdint>
#include <vector>

#include "gpu/command_stream.hpp"
#include "gpu/kernel.hpp"
#include "scale_and_add.hpp"

namespace palpate::gpu {

/// target[i] = factor * source[i] + addend on the device, in uint32 arithmetic.
class ScaleAndAdd {
 public:
  static constexpr std::uint32_t workgroup = 32;

  struct Push {
    std::uint32_t count;
    std::uint32_t addend;
  };

  ScaleAndAdd(Context& context, std::uint32_t factor)
      : kernel_(context, {.name = "scale_and_add",
                          .spirv = shaders::scale_and_add,
                          .bindings = {Access::storage, Access::storage},
                          .push_bytes = sizeof(Push),
                          .constants = {workgroup, factor}}) {}

  void dispatch(CommandStream& stream, const Buffer& source, const Buffer& target,
                std::uint32_t addend) const {
    const auto count = static_cast<std::uint32_t>(target.bytes() / sizeof(std::uint32_t));
    stream.dispatch(kernel_, {&source, &target}, Push{count, addend},
                    {(count + workgroup - 1) / workgroup, 1, 1});
  }
  const Kernel& kernel() const { return kernel_; }

 private:
  Kernel kernel_;
};

/// Values that differ from their neighbours in every byte.
template <typename T>
std::vector<T> pattern(std::size_t n) {
  std::vector<T> values(n);
  std::uint32_t state = 12345;
  for (T& value : values) {
    state = state * 1664525 + 1013904223;
    value = static_cast<T>(state >> 8);
  }
  return values;
}

}  // namespace palpate::gpu
