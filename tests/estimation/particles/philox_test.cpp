#include "estimation/particles/particle_draws.hpp"

#include <vector>

#include <gtest/gtest.h>

#include "gpu/command_stream.hpp"
#include "philox_words.hpp"
#include "support/shared_device.hpp"

namespace palpate::philox_test {

using Words = std::array<std::uint32_t, 4>;

struct Input {
  Words counter;
  std::array<std::uint32_t, 2> key;
};

std::vector<Words> on_device(std::span<const Input> inputs) {
  gpu::Context& context = shared_device().context();
  const gpu::Kernel kernel(context, {.name = "philox_words",
                                     .spirv = shaders::philox_words,
                                     .bindings = {gpu::Access::storage, gpu::Access::storage},
                                     .push_bytes = 4});
  gpu::CommandStream stream(context);
  std::vector<Words> words(inputs.size());
  const gpu::Buffer given(context, inputs.size_bytes(), gpu::Memory::device, "a test");
  const gpu::Buffer made(context, std::span(words).size_bytes(), gpu::Memory::device, "a test");
  stream.upload(given, inputs);
  const auto count = static_cast<std::uint32_t>(inputs.size());
  stream.dispatch(kernel, {&given, &made}, count, {(count + 63) / 64, 1, 1});
  stream.download(made, std::span(words));
  stream.run();
  return words;
}

TEST(Philox, GivesThePublishedWords) {
  // kat_vectors of Random123 1.14, philox4x32 10.
  const std::vector<Input> inputs = {
      {{0, 0, 0, 0}, {0, 0}},
      {{0xffffffff, 0xffffffff, 0xffffffff, 0xffffffff}, {0xffffffff, 0xffffffff}},
      {{0x243f6a88, 0x85a308d3, 0x13198a2e, 0x03707344}, {0xa4093822, 0x299f31d0}}};
  const std::vector<Words> published = {{0x6627e8d5, 0xe169c58d, 0xbc57ac4c, 0x9b00dbd8},
                                        {0x408f276d, 0x41c83b0e, 0xa20bc7c6, 0x6d5451fd},
                                        {0xd16cfe09, 0x94fdcceb, 0x5001e420, 0x24126ea1}};
  EXPECT_EQ(on_device(inputs), published);
  for (std::size_t i = 0; i < inputs.size(); ++i) {
    EXPECT_EQ(philox(inputs[i].counter, inputs[i].key), published[i]) << i;
  }
}

}  // namespace palpate::philox_test
