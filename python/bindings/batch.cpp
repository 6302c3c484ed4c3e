// What `palpate batch` settles and recognises, for processes that somebody else hands the
// recordings to: palpate/many.py.

#include <memory>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <nanobind/stl/shared_ptr.h>
#include <nanobind/stl/tuple.h>
#include <nanobind/stl/vector.h>

#include "bindings.hpp"
#include "palpate/error.hpp"
#include "recognition/batch/batch_task.hpp"
#include "recognition/batch/input_reading.hpp"
#include "recognition/record_json.hpp"
#include "recognition/recordings.hpp"
#include "request.hpp"
#include "shared.hpp"

namespace palpate::python {

using namespace nb::literals;

namespace {

using Entries = std::vector<std::tuple<std::string, std::size_t>>;

std::tuple<std::string, Entries, Sentences> settle(const std::vector<std::string>& inputs,
                                                   nb::handle maps, PythonRequest request,
                                                   Device& device, std::size_t threads) {
  if (inputs.empty()) {
    throw Error(Fault::input, "paths: none; give recordings, a folder of them or a manifest");
  }
  add_maps(maps, request);
  auto [task, sentences] = run([&] {
    refuse_budget(request);
    require_selection(request);
    const Request completed = complete(request);
    BatchTask settled{.program = PALPATE_VERSION,
                      .chunk_unknowns = 1,  // chunks are of recordings, whoever makes them
                      .request = request,
                      .inputs = list_inputs(inputs)};
    survey_inputs(settled.inputs, completed, threads, [](double) { check_signals(); });
    settled.inferred = infer(settled.inputs, completed);
    hash_files(settled, completed);
    const RecognitionJob job = job_of(settled, completed, [&]() -> Device& { return device; });
    return std::pair(std::move(settled), in_python(job.task().remarks));
  });
  Entries entries;
  for (const BatchEntry& entry : task.inputs) {
    entries.emplace_back(entry_text(entry), task.unknowns_of(entry));
  }
  task.inputs.clear();
  return {head_text(task), std::move(entries), std::move(sentences)};
}

/// A settled batch on a device, ready to recognise any of its recordings.
struct OpenBatch {
  BatchTask task;
  RecognitionJob job;
  Recogniser recogniser;
};

OpenBatch open_batch(const std::string& head, Device& device, std::size_t threads) {
  BatchTask task = head_from(head);
  const Request request = complete(task.request);
  BatchTask own = task;
  own.program = PALPATE_VERSION;
  hash_files(own, request);
  if (const std::string difference = difference_of_tasks(task, own); !difference.empty()) {
    throw Error(Fault::input,
                fmt::format("{}; give all workers the same palpate, maps, scene and sensor model",
                            difference));
  }
  RecognitionJob job = job_of(task, request, [&device]() -> Device& { return device; });
  Recogniser recogniser = job.open({.threads = threads, .cancel_point = check_signals});
  return {std::move(task), std::move(job), std::move(recogniser)};
}

using Lines = std::vector<std::tuple<std::string, std::string, double>>;

/// The entries' lines, and a sentence on what is not resolved, "" where there is none.
std::tuple<Lines, std::string> recognise_entries(OpenBatch& batch,
                                                 const std::vector<std::string>& entries) {
  const Request& request = batch.job.request();
  const RecognitionTask& task = batch.job.task();
  Lines lines;
  std::string unresolved;
  for (const std::string& entry : entries) {
    const ReadInput read = read_entry(batch.task, entry_from(entry), request);
    for (const Query& unknown : read.unknowns) {
      const RecognitionRecord record = recognise(batch.recogniser, task, unknown, request.trace,
                                                 [](double) { check_signals(); });
      if (record.error.empty() && unresolved.empty()) {
        unresolved = in_keywords(batch.recogniser.unresolved_words());
      }
      const auto text = [&](OptionWords words) {
        return palpate::text_of(to_json(record, task, std::nullopt, request.trace, words));
      };
      std::string line = text(in_flags);
      std::string own = text(in_keywords);
      lines.emplace_back(line, own == line ? "" : own, record.seconds);
    }
  }
  return {std::move(lines), std::move(unresolved)};
}

/// What never changes of an open batch, as a property.
template <typename F>
auto of_batch(F property) {
  return [property](const Shared<OpenBatch>& self) { return property(self.constant()); };
}

}  // namespace

void bind_batch(nb::module_& module) {
  module.def("settle_batch", &settle, "paths"_a, "maps"_a, "request"_a, "device"_a, "threads"_a,
             "What follows from all recordings together, as `palpate batch` settles it: the head\n"
             "of the task, an entry for each recording with the number of its unknowns, and what\n"
             "is worth a warning.");
  module.def(
      "device_of", [](const PythonRequest& request) { return complete(request).device; },
      "request"_a, "The device that the request or its scene names, or \"\".");
  nb::class_<Shared<OpenBatch>>(module, "OpenBatch",
                                "A settled batch on a device, ready to recognise any of its "
                                "recordings. One thread at\na time recognises.")
      .def_static(
          "open",
          [](const std::string& head, const std::shared_ptr<Device>& device, std::size_t threads) {
            return make_shared_on(device,
                                  [&](Device& on) { return open_batch(head, on, threads); });
          },
          "head"_a, "device"_a, "threads"_a,
          "Raises Error where palpate, a map, the scene or the sensor model is not as it was when\n"
          "the batch was settled.")
      .def_prop_ro("on_host",
                   of_batch([](const OpenBatch& open) { return !open.job.task().uses_device(); }),
                   "Whether bounds recognise, which compute on the host alone.")
      .def_prop_ro("lattice",
                   of_batch([](const OpenBatch& open) { return open.recogniser.lattice(); }),
                   "The bins, whose pivot is (0, 0) where it is automatic.")
      .def_prop_ro("auto_pivot",
                   of_batch([](const OpenBatch& open) { return open.job.task().auto_pivot; }),
                   "Whether theta turns about each unknown's first touch.")
      .def_prop_ro("maps", of_batch([](const OpenBatch& open) {
                     std::vector<std::tuple<std::string, Hypothesis>> maps;
                     const RecognitionTask& task = open.job.task();
                     for (std::size_t i = 0; i < task.hypotheses.size(); ++i) {
                       maps.emplace_back(task.map_paths[i], task.hypotheses[i]);
                     }
                     return maps;
                   }),
                   "The maps, by their files; symmetries and mirror images are the task's.")
      .def_prop_ro("memory_bytes", of_batch([](const OpenBatch& open) {
                     const Filter& filter = open.recogniser.filter();
                     return filter.device_bytes() + filter.host_bytes();
                   }),
                   "Memory held: the device's, or the host's where bounds recognise.")
      .def(
          "recognize",
          [](const Shared<OpenBatch>& self, const std::vector<std::string>& entries) {
            return self.use([&](OpenBatch& open) { return recognise_entries(open, entries); });
          },
          "entries"_a,
          "The record of each unknown as a line of JSON, as `palpate batch` writes it; again,\n"
          "with options in the words of Python, or \"\" where that is the same; and its seconds.\n"
          "Then what is worth a warning, or \"\". A recording that cannot be recognised has a\n"
          "record with its error.\n\n"
          "Raises Error where a recording has changed since the batch was settled.");
}

}  // namespace palpate::python
