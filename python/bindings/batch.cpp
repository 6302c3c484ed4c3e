// What `palpate batch` settles and recognises, for processes that somebody else hands the
// recordings to: palpate/many.py.

#include <algorithm>
#include <iterator>
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

nb::bytes bytes_of(const std::string& text) { return nb::bytes(text.data(), text.size()); }
std::string text_in(const nb::bytes& bytes) { return {bytes.c_str(), bytes.size()}; }

using Entries = std::vector<std::tuple<nb::bytes, std::size_t>>;

std::tuple<nb::bytes, Entries, Sentences> settle(const std::vector<std::string>& inputs,
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
    entries.emplace_back(bytes_of(entry_text(entry)), task.unknowns_of(entry));
  }
  task.inputs.clear();
  return {bytes_of(head_text(task)), std::move(entries), std::move(sentences)};
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

struct Line {
  std::string text;         ///< as `palpate batch` writes it
  std::string python_text;  ///< with options in the words of Python
  double seconds;
};

/// The entries' lines, and a sentence on what is not resolved, "" where there is none.
std::pair<std::vector<Line>, std::string> recognise_entries(
    OpenBatch& batch, const std::vector<std::string>& entries) {
  const Request& request = batch.job.request();
  const RecognitionTask& task = batch.job.task();
  std::vector<Line> lines;
  std::string unresolved;
  for (const std::string& entry : entries) {
    const ReadInput read = read_entry(batch.task, entry_from(entry), request);
    for (const Query& unknown : read.unknowns) {
      const RecognitionRecord record = recognise(batch.recogniser, task, unknown, request.trace,
                                                 [](double) { check_signals(); });
      if (record.error.empty() && unresolved.empty()) {
        unresolved = batch.recogniser.unresolved_words();
      }
      const auto text = [&](OptionWords words) {
        return palpate::text_of(to_json(record, task, std::nullopt, request.trace, words));
      };
      lines.push_back({text(in_flags), text(in_keywords), record.seconds});
    }
  }
  return {std::move(lines), std::move(unresolved)};
}

using Lines = std::vector<std::tuple<nb::bytes, nb::bytes, double>>;

std::tuple<Lines, std::string> recognise_python(const Shared<OpenBatch>& batch,
                                                const std::vector<nb::bytes>& entries) {
  std::vector<std::string> texts;
  std::ranges::transform(entries, std::back_inserter(texts), text_in);
  const auto [recognised, unresolved] =
      batch.use([&](OpenBatch& open) { return recognise_entries(open, texts); });
  Lines lines;
  for (const Line& line : recognised) {
    lines.emplace_back(bytes_of(line.text),
                       bytes_of(line.python_text == line.text ? "" : line.python_text),
                       line.seconds);
  }
  return {std::move(lines), in_keywords(unresolved)};
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
          [](const nb::bytes& head, const std::shared_ptr<Device>& device, std::size_t threads) {
            const std::string text = text_in(head);
            return make_shared_on(device,
                                  [&](Device& on) { return open_batch(text, on, threads); });
          },
          "head"_a, "device"_a, "threads"_a,
          "Raises Error where palpate, a map, the scene or the sensor model is not as it was when\n"
          "the batch was settled.")
      .def_prop_ro(
          "on_host",
          [](const Shared<OpenBatch>& self) { return !self.constant().job.task().uses_device(); },
          "Whether bounds recognise, which compute on the host alone.")
      .def_prop_ro(
          "lattice",
          [](const Shared<OpenBatch>& self) { return self.constant().recogniser.lattice(); },
          "The bins, whose pivot is (0, 0) where it is automatic.")
      .def_prop_ro(
          "auto_pivot",
          [](const Shared<OpenBatch>& self) { return self.constant().job.task().auto_pivot; },
          "Whether theta turns about each unknown's first touch.")
      .def_prop_ro(
          "maps",
          [](const Shared<OpenBatch>& self) {
            std::vector<std::tuple<std::string, Hypothesis>> maps;
            const RecognitionTask& task = self.constant().job.task();
            for (std::size_t i = 0; i < task.hypotheses.size(); ++i) {
              maps.emplace_back(task.map_paths[i], task.hypotheses[i]);
            }
            return maps;
          },
          "The maps, by their files; symmetries and mirror images are the task's.")
      .def_prop_ro(
          "memory_bytes",
          [](const Shared<OpenBatch>& self) {
            const Recogniser& recogniser = self.constant().recogniser;
            return recogniser.filter().device_bytes() + recogniser.filter().host_bytes();
          },
          "Memory held: the device's, or the host's where bounds recognise.")
      .def(
          "recognize", &recognise_python, "entries"_a,
          "The record of each unknown as a line of JSON, as `palpate batch` writes it; again,\n"
          "with options in the words of Python, or b\"\" where that is the same; and its seconds.\n"
          "Then what is worth a warning, or \"\". A recording that cannot be recognised has a\n"
          "record with its error.\n\n"
          "Raises Error where a recording has changed since the batch was settled.");
}

}  // namespace palpate::python
