#include "cli/batch/settled_task.hpp"

#include <algorithm>
#include <map>
#include <string>
#include <utility>

#include "cli/filter_flags.hpp"
#include "cli/options.hpp"
#include "cli/sensor_model_flag.hpp"

namespace palpate::cli {

namespace {

/// Hashes of the files that the recognition depends on.
std::map<std::string, std::string> hashes_of(const RecognitionFlags& flags, const Scene& scene,
                                             const RecognitionTask& recognition) {
  std::map<std::string, std::string> hashes;
  const auto add = [&](const std::string& file) {
    if (!file.empty() && !hashes.contains(file)) {
      hashes[file] = hash_of_file(file);
    }
  };
  add(flags.scene);
  add(scene.array_file ? scene.array_file->string() : "");
  add(sensor_model_file(flags, scene));
  for (const std::string& map : recognition.map_paths) {
    add(map);
  }
  return hashes;
}

}  // namespace

void refuse_budget(const RecognitionFlags& flags) {
  if (flags.filter.budget_ms) {
    refuse_flag("--budget-ms", *flags.filter.budget_ms,
                "its results depend on the clock, and a batch's are the same on every run; leave "
                "it out, or use palpate recognize");
  }
}

void stamp_inputs(BatchTask& task) {
  for (BatchEntry& entry : task.inputs) {
    entry.stamp = stamp_of(entry.input.path);
  }
}

void survey(BatchTask& task, const RecognitionFlags& flags, const InputRules& rules,
            std::size_t threads, const std::function<void(double)>& progress) {
  if (task.each_frame || infers_region(flags, rules.scene)) {
    survey_inputs(task.inputs, rules, threads, progress);
  }
}

RecognitionTask recognition_of(BatchTask& task, const RecognitionFlags& flags,
                               const InputRules& rules) {
  const BatchInference& inferred = task.inferred;
  RecognitionTask recognition =
      task_of(flags, rules.scene, inferred.pressure_unit, inferred.unit_from, inferred.reach_mm);
  if (auto* histogram = std::get_if<HistogramOptions>(&recognition.filter)) {
    histogram->still_array = inferred.still_array;
  }
  task.files = hashes_of(flags, rules.scene, recognition);
  return recognition;
}

void settle_recognition(BatchTask& task, RecognitionTask& recognition,
                        const RecognitionFlags& flags, const InputRules& rules,
                        const Device* device) {
  if (device != nullptr) {
    for (const std::string& sentence : settle_task(flags, rules.scene, *device, recognition)) {
      flags.tell(sentence);
    }
  } else {
    settle_filter(recognition);
    settle_evidence(recognition);
    if (const std::string wider = wider_bins_sentence(recognition); !wider.empty()) {
      flags.tell(wider);
    }
  }
  const PoseLattice& lattice = recognition.lattice();
  task.bins = {lattice.x_mm.count, lattice.y_mm.count, lattice.theta_rad.count};
}

void settle_as_before(const BatchTask& task, RecognitionTask& recognition) {
  PoseLattice& lattice = recognition.lattice();
  lattice.x_mm.count = task.bins[0];
  lattice.y_mm.count = task.bins[1];
  lattice.theta_rad.count = task.bins[2];
  recognition.bin_width.reset();
  settle_filter(recognition);
  settle_evidence(recognition);
}

bool uses_device(const RecognitionTask& recognition) {
  return !traits_of(recognition.filter).certificate;
}

void take_threads(RecognitionTask& recognition, std::size_t threads) {
  if (auto* bounded = std::get_if<BoundedOptions>(&recognition.filter)) {
    bounded->threads = static_cast<int>(std::max<std::size_t>(1, threads));
  }
}

Recogniser open_batch_filter(Device* device, const RecognitionTask& recognition) {
  return uses_device(recognition) ? open_filter(*device, recognition) : Recogniser(recognition);
}

}  // namespace palpate::cli
