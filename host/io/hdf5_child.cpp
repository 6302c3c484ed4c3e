#include "io/hdf5_child.hpp"

#include "io/forked_child.hpp"
#include "io/hdf5_contents.hpp"
#include "io/hdf5_reader.hpp"

namespace palpate {

namespace {

void send(ForkedSender& sender, Hdf5Record kind, const std::string& name, const Hdf5Value& value) {
  sender.value(kind);
  sender.list(name);
  sender.list(value.problem);
  sender.list(value.shape);
  sender.list(value.numbers);
  sender.value(std::uint64_t{value.strings.size()});
  for (const std::string& text : value.strings) {
    sender.list(text);
  }
}

}  // namespace

void serve_hdf5(int socket, const std::filesystem::path& path, std::uint64_t file_bytes,
                const std::vector<std::string>& attributes,
                const std::vector<std::string>& datasets) {
  ForkedSender sender(socket);
  H5Eset_auto2(H5E_DEFAULT, nullptr, nullptr);
  H5PLset_loading_state(0);          // a file's filters must not load code
  H5Lunregister(H5L_TYPE_EXTERNAL);  // nor its links open other files, which may be FIFOs
  Hdf5Reader reader(path, file_bytes, attributes, datasets,
                    {.follows_links = true,
                     .memory_bytes = allow_memory_bytes,
                     .cpu_seconds = allow_cpu_seconds});
  if (!reader.problem().empty()) {
    Hdf5Value refused;
    refused.problem = reader.problem();
    send(sender, Hdf5Record::refused, "", refused);
    sender.value(Hdf5Record::end);
    sender.flush();
    return;
  }
  for (const auto& [name, value] : reader.attributes()) {
    send(sender, Hdf5Record::attribute, name, value);
  }
  for (const auto& [name, value] : reader.datasets()) {
    send(sender, Hdf5Record::dataset, name, value);
  }
  sender.value(Hdf5Record::end);
  sender.flush();
  for (;;) {
    Hdf5Request request{};
    forked_read(socket, &request, sizeof request);  // ends the child after the last request
    const auto send_rows = [&](std::span<const double> numbers) { sender.list(numbers); };
    if (!reader.read(datasets.at(request.dataset), request.first, request.count, send_rows)) {
      send_rows({});
    }
    sender.flush();
  }
}

}  // namespace palpate
