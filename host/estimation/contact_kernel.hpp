#pragma once

#include <cstdint>
#include <vector>

#include "gpu/command_stream.hpp"
#include "palpate/contact_model.hpp"

namespace palpate {

/// The specialization constants 0 to 6 of the kernels that evaluate the contact model: the
/// lanes of a workgroup, then those of shaders/segment_sum.glsl. The model's prior must be
/// set.
std::vector<std::uint32_t> contact_constants(const gpu::Limits& limits, const ContactModel& model);

/// The objects' numbers of the model's table on the device, shaders::TableNode. A model without a
/// table has one node that no kernel reads, because kernels bind the buffer all the same.
class ContactTable {
 public:
  /// Records the upload.
  /// @throws Error where the table has more nodes than the device reads
  ContactTable(gpu::Context& context, gpu::CommandStream& stream, const ContactModel& model);

  const gpu::Buffer& nodes() const { return nodes_; }
  /// Index of the first node of an object's numbers.
  int first_node(std::size_t object) const;

 private:
  std::size_t sets_ = 1;
  std::size_t nodes_of_a_set_ = 0;
  gpu::Buffer nodes_;
};

}  // namespace palpate
