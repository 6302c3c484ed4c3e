#include "recognition/batch/batch_resolution.hpp"

#include <utility>

#include "io/file_hash.hpp"
#include "options/refused_option.hpp"

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

RecognitionJob job_of(BatchTask& task, const Request& request, DeviceSource device) {
  Circumstances circumstances = task.inferred;
  if (task.bins != std::array<int, 3>{}) {
    circumstances.counts = task.bins;
  }
  RecognitionJob job(request, circumstances, std::move(device));
  const PoseLattice& lattice = job.task().lattice();
  task.bins = {lattice.x_mm.count, lattice.y_mm.count, lattice.theta_rad.count};
  return job;
}

}  // namespace palpate
