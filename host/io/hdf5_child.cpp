#include "hdf5_child.hpp"

#include "forked_child.hpp"
#include "hdf5_contents.hpp"
#include "hdf5_reader.hpp"

namespace palpate {

namespace {

class Sender {
 public:
  explicit Sender(int socket) : socket_(socket) {}

  void send(Hdf5Record kind) { forked_write(socket_, &kind, sizeof kind); }

  void send(Hdf5Record kind, const std::string& name, const Hdf5Value& value) {
    send(kind);
    send_list(name);
    send_list(value.problem);
    send_list(value.shape);
    send_list(value.numbers);
    send_size(value.strings.size());
    for (const std::string& text : value.strings) {
      send_list(text);
    }
  }

  void refuse(std::string problem) {
    Hdf5Value value;
    value.problem = std::move(problem);
    send(Hdf5Record::refused, "", value);
    send(Hdf5Record::end);
  }

 private:
  void send_size(std::uint64_t size) { forked_write(socket_, &size, sizeof size); }

  template <class List>
  void send_list(const List& list) {
    send_size(list.size());
    forked_write(socket_, list.data(), list.size() * sizeof(typename List::value_type));
  }

  int socket_;
};

}  // namespace

void serve_hdf5(int socket, const std::filesystem::path& path, std::uint64_t file_bytes,
                const std::vector<std::string>& attributes,
                const std::vector<std::string>& datasets) {
  Sender sender(socket);
  H5Eset_auto2(H5E_DEFAULT, nullptr, nullptr);
  H5PLset_loading_state(0);          // a file's filters must not load code
  H5Lunregister(H5L_TYPE_EXTERNAL);  // nor its links open other files, which may be FIFOs
  Hdf5Reader reader(path, file_bytes, attributes, datasets,
                    {.follows_links = true,
                     .memory_bytes = allow_memory_bytes,
                     .cpu_seconds = allow_cpu_seconds});
  if (!reader.problem().empty()) {
    sender.refuse(reader.problem());
    return;
  }
  for (const auto& [name, value] : reader.attributes()) {
    sender.send(Hdf5Record::attribute, name, value);
  }
  for (const auto& [name, value] : reader.datasets()) {
    sender.send(Hdf5Record::dataset, name, value);
  }
  sender.send(Hdf5Record::end);
  for (;;) {
    Hdf5Request request{};
    forked_read(socket, &request, sizeof request);  // ends the child after the last request
    const auto send = [&](std::span<const double> numbers) {
      const std::uint64_t size = numbers.size();
      forked_write(socket, &size, sizeof size);
      forked_write(socket, numbers.data(), size * sizeof(double));
    };
    if (!reader.read(datasets.at(request.dataset), request.first, request.count, send)) {
      send({});
    }
  }
}

}  // namespace palpate
