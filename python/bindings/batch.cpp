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
#include "cli/batch/settled_task.hpp"
#include "cli/filter_flags.hpp"
#include "cli/record_output.hpp"
#include "palpate/error.hpp"
#include "request.hpp"
#include "session.hpp"

namespace palpate::python {

using namespace nb::literals;

namespace {

using Sentences = std::vector<std::string>;

nb::bytes bytes_of(const std::string& text) { return nb::bytes(text.data(), text.size()); }
std::string text_in(const nb::bytes& bytes) { return {bytes.c_str(), bytes.size()}; }

cli::InputRules rules_of(const Request& request) {
  return {.flags = request.unknowns,
          .frames = cli::frames_of(request.unknowns),
          .scene = cli::scene_of(request.flags),
          .scene_file = request.flags.scene};
}

struct Settled {
  cli::BatchTask task;
  Sentences sentences;  ///< what is worth a warning
};

Settled settle(const std::vector<std::string>& inputs, Request request, const Device& device,
               std::size_t threads, Call& call) {
  Settled settled{{.program = PALPATE_VERSION,
                   .chunk_unknowns = 1,  // chunks are of recordings, whoever makes them
                   .each_frame = request.unknowns.each_frame},
                  {}};
  request.flags.tell = [&](const std::string& sentence) {
    settled.sentences.push_back(in_keywords(sentence));
  };
  cli::refuse_budget(request.flags);
  const cli::InputRules rules = rules_of(request);
  for (cli::BatchInput& input : cli::list_inputs(inputs)) {
    settled.task.inputs.push_back({std::move(input), {}, {}});
  }
  cli::stamp_inputs(settled.task);
  cli::survey(settled.task, request.flags, rules, threads, call.progress());
  settled.task.inferred = cli::infer(settled.task.inputs, rules);
  RecognitionTask recognition = cli::recognition_of(settled.task, request.flags, rules);
  cli::settle_recognition(settled.task, recognition, request.flags, rules, &device);
  return settled;
}

nb::tuple settle_python(const std::vector<std::string>& inputs, const nb::list& maps,
                        Request request, const std::shared_ptr<Session>& session, int threads) {
  if (inputs.empty()) {
    throw Error(Fault::input, "paths: none; give recordings, a folder of them or a manifest");
  }
  add_maps(maps, request.flags);
  const Settled settled = run([=](Call& call) {
    auto lock = session->lock(call);
    return settle(inputs, request, lock.device(), static_cast<std::size_t>(threads), call);
  });
  nb::list entries;
  for (const cli::BatchEntry& entry : settled.task.inputs) {
    entries.append(
        nb::make_tuple(bytes_of(cli::entry_text(entry)), settled.task.unknowns_of(entry)));
  }
  cli::BatchTask head = settled.task;
  head.inputs.clear();
  return nb::make_tuple(bytes_of(cli::head_text(head)), entries, settled.sentences);
}

/// A settled batch on a device, ready to recognise any of its recordings.
struct OpenBatch {
  cli::BatchTask task;
  cli::InputRules rules;
  RecognitionTask recognition;
  bool trace;
  std::shared_ptr<const Call*> current;  ///< the call at work, which sets it, for bounds' search
  Recogniser recogniser;
};

OpenBatch open_batch(const std::string& head, const Request& request, Device& device,
                     std::size_t threads) {
  const cli::BatchTask task = cli::head_from(head);
  cli::BatchTask own = task;
  own.program = PALPATE_VERSION;
  cli::InputRules rules = rules_of(request);
  RecognitionTask recognition = cli::recognition_of(own, request.flags, rules);
  if (const std::string difference = cli::difference_of_tasks(task, own); !difference.empty()) {
    throw Error(Fault::input,
                fmt::format("{}; give all workers the same palpate, maps, scene and sensor model",
                            difference));
  }
  cli::settle_as_before(task, recognition);
  cli::take_threads(recognition, threads);
  const auto current = std::make_shared<const Call*>(nullptr);
  recognition.cancel_point = [current] {
    if (*current != nullptr) {
      (*current)->check();
    }
  };
  Recogniser recogniser = cli::open_batch_filter(&device, recognition);
  return {task,          std::move(rules), std::move(recognition),
          request.trace, current,          std::move(recogniser)};
}

struct Line {
  std::string text;
  double seconds;
};

struct Chunk {
  std::vector<Line> lines;
  std::string unresolved;  ///< a sentence; "" where there is none
};

Chunk recognise_entries(OpenBatch& batch, const std::vector<std::string>& entries,
                        const Call& call) {
  *batch.current = &call;
  Chunk chunk;
  RecordingReader reader;
  for (const std::string& text : entries) {
    const cli::ReadInput read =
        cli::read_entry(reader, batch.task, cli::entry_from(text), batch.rules);
    for (const Unknown& unknown : read.unknowns) {
      const RecognitionRecord record = recognise(batch.recogniser, batch.recognition, unknown,
                                                 batch.trace, [&](double) { call.check(); });
      if (record.error.empty() && chunk.unresolved.empty()) {
        chunk.unresolved =
            cli::unresolved_words(batch.recognition, batch.recogniser.lattice(), unknown.touches);
      }
      chunk.lines.push_back(
          {cli::text_of(cli::to_json(record, batch.recognition, std::nullopt, batch.trace)),
           record.seconds});
    }
  }
  return chunk;
}

nb::tuple recognise_python(const Owned<OpenBatch>& batch, const nb::list& entries) {
  std::vector<std::string> texts;
  for (const nb::handle entry : entries) {
    texts.push_back(text_in(value_of<nb::bytes>(entry, "entries: give bytes of settle_batch()")));
  }
  const Chunk chunk = batch.use([texts = std::move(texts)](OpenBatch& open, Call& call) {
    return recognise_entries(open, texts, call);
  });
  nb::list lines;
  for (const Line& line : chunk.lines) {
    lines.append(nb::make_tuple(bytes_of(line.text), line.seconds));
  }
  return nb::make_tuple(lines, chunk.unresolved);
}

}  // namespace

void bind_batch(nb::module_& module) {
  module.def("settle_batch", &settle_python, "paths"_a, "maps"_a, "flags"_a, "device"_a,
             "threads"_a,
             nb::sig("def settle_batch(paths: collections.abc.Sequence[str], maps: list[str], "
                     "flags: RecognitionFlags, device: Device, threads: int) -> tuple[bytes, "
                     "list[tuple[bytes, int]], list[str]]"),
             "What follows from all recordings together, as `palpate batch` settles it: the head\n"
             "of the task, an entry for each recording with the number of its unknowns, and what\n"
             "is worth a warning.");
  module.def(
      "device_of",
      [](const Request& request) {
        return cli::device_of(request.flags, cli::scene_of(request.flags));
      },
      "flags"_a, "The device that the flags or their scene name, or \"\".");
  nb::class_<Owned<OpenBatch>>(module, "OpenBatch",
                               "A settled batch on a device, ready to recognise any of its "
                               "recordings. One thread at\na time recognises.")
      .def_static(
          "open",
          [](const nb::bytes& head, const nb::list& maps, Request request,
             const std::shared_ptr<Session>& session, int threads) {
            add_maps(maps, request.flags);
            return make_owned<OpenBatch>(
                {}, session, [head = text_in(head), request, threads](Device& device) {
                  return open_batch(head, request, device, static_cast<std::size_t>(threads));
                });
          },
          "head"_a, "maps"_a, "flags"_a, "device"_a, "threads"_a,
          nb::sig("def open(head: bytes, maps: list[str], flags: RecognitionFlags, device: "
                  "Device, threads: int) -> OpenBatch"),
          "Raises Error where palpate, a map, the scene or the sensor model is not as it was when\n"
          "the batch was settled.")
      .def_prop_ro(
          "on_host",
          [](const Owned<OpenBatch>& self) {
            return !cli::uses_device(self.constant().recognition);
          },
          "Whether bounds recognise, which compute on the host alone.")
      .def_prop_ro(
          "lattice",
          [](const Owned<OpenBatch>& self) { return self.constant().recogniser.lattice(); },
          "The bins, whose pivot is (0, 0) where it is automatic.")
      .def_prop_ro(
          "auto_pivot",
          [](const Owned<OpenBatch>& self) { return self.constant().recognition.auto_pivot; },
          "Whether theta turns about each unknown's first touch.")
      .def_prop_ro(
          "maps",
          [](const Owned<OpenBatch>& self) {
            std::vector<std::tuple<std::string, Hypothesis>> maps;
            const RecognitionTask& recognition = self.constant().recognition;
            for (std::size_t i = 0; i < recognition.hypotheses.size(); ++i) {
              maps.emplace_back(recognition.map_paths[i], recognition.hypotheses[i]);
            }
            return maps;
          },
          "The maps, by their files; symmetries and mirror images are the task's.")
      .def_prop_ro(
          "memory_bytes",
          [](const Owned<OpenBatch>& self) {
            const Recogniser& recogniser = self.constant().recogniser;
            return recogniser.device_bytes() + recogniser.host_bytes();
          },
          "Memory held: the device's, or the host's where bounds recognise.")
      .def("recognize", &recognise_python, "entries"_a,
           nb::sig("def recognize(self, entries: list[bytes]) -> tuple[list[tuple[bytes, float]], "
                   "str]"),
           "The record of each unknown as a line of JSON, as `palpate batch` writes it, and its\n"
           "seconds; then what is worth a warning, or \"\". A recording that cannot be recognised\n"
           "has a record with its error.\n\n"
           "Raises Error where a recording has changed since the batch was settled.");
}

}  // namespace palpate::python
