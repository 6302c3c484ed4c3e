#include "recognition/batch/batch_resolution.hpp"

#include "io/file_hash.hpp"
#include "options/refused_option.hpp"
#include "recognition/resolve.hpp"

namespace palpate {

void refuse_budget(const Request& request) {
  if (request.budget_ms) {
    refuse_option("budget-ms", *request.budget_ms,
                  "its results depend on the clock, and a batch's are the same on every run; leave "
                  "it out, or use palpate recognize");
  }
}

void hash_files(BatchTask& task, const Request& request) {
  task.files.clear();
  for (const auto& [option, file] : files_of(request)) {
    if (!task.files.contains(file.string())) {
      task.files[file.string()] = hash_of_file(file);
    }
  }
}

RecognitionTask resolve_batch(BatchTask& task, const Request& request,
                              const std::function<Device&()>& device) {
  const BatchInference& inferred = task.inferred;
  const bool settled = task.bins != std::array<int, 3>{};
  RecognitionTask recognition =
      resolve(request, {.pressure_unit = inferred.pressure_unit,
                        .source = inferred.unit_from,
                        .reach_mm = inferred.reach_mm,
                        .device = device,
                        .counts = settled ? std::optional(task.bins) : std::nullopt});
  const PoseLattice& lattice = recognition.lattice();
  task.bins = {lattice.x_mm.count, lattice.y_mm.count, lattice.theta_rad.count};
  return recognition;
}

}  // namespace palpate
