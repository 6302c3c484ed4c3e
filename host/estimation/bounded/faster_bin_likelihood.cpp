#include "estimation/bounded/faster_bin_likelihood.hpp"

#include <algorithm>
#include <chrono>

#include <fmt/format.h>
#include "estimation/bounded/parallel_for.hpp"
#include "model/log_message.hpp"
#include "palpate/error.hpp"

namespace palpate {

namespace {

/// Bins of a host thread's task: large beside the cost of a task, small beside a large batch.
constexpr std::size_t task_bins = 2048;
/// Of the work before both places are measured: the least batch that tells their rates.
constexpr double measured_part = 0.01;

template <typename Work>
double seconds_of(const Work& work) {
  const auto begin = std::chrono::steady_clock::now();
  work();
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
}

}  // namespace

FasterBinLikelihood::FasterBinLikelihood(const BinLikelihood& host, gpu::Context* context,
                                         std::span<const Hypothesis> hypotheses,
                                         const ContactModel& contact, const PoseLattice& lattice,
                                         BinPlace place, double measured_work)
    : host_(host),
      context_(context),
      hypotheses_(hypotheses),
      contact_(contact),
      lattice_(lattice),
      place_(place),
      measured_work_(measured_work),
      device_error_(hypotheses, contact, lattice) {
  if (place == BinPlace::device) {
    path_ = fmt::format("bins on device '{}', as told", context->name());
  } else if (place == BinPlace::host) {
    path_ = "bins on the host, as told";
  } else if (context->limits().cpu) {
    // It has the same cores, and a kernel that is not made for their vectors.
    place_ = BinPlace::host;
    path_ = fmt::format("bins on the host: device '{}' is a CPU", context->name());
  } else {
    path_ = "bins on the host: too few so far to measure the device";
  }
}

void FasterBinLikelihood::move_pivot(const glm::dvec2& pivot_mm) {
  lattice_.pivot_mm = pivot_mm;
  if (device_) {
    device_->move_pivot(pivot_mm);
  }
}

DeviceBinLikelihood& FasterBinLikelihood::device() {
  if (!device_) {
    device_ = std::make_unique<DeviceBinLikelihood>(*context_, hypotheses_, contact_, lattice_);
  }
  return *device_;
}

void FasterBinLikelihood::evaluate(std::span<const BinBox> boxes, const KnownElements& elements,
                                   std::span<float> log_likelihood, bool may_measure) {
  const double work = static_cast<double>(log_likelihood.size()) *
                      static_cast<double>(elements.from_pivot_mm.size());
  if (place_ == BinPlace::device && work >= least_device_work_) {
    device().evaluate(boxes, elements, log_likelihood);
    return;
  }
  host_work_ += work;
  if (place_ == BinPlace::measured && may_measure && host_work_ >= measured_work_ &&
      work >= measured_part * measured_work_) {
    measure(boxes, elements, log_likelihood, work);
  } else {
    evaluate_on_host(boxes, elements, log_likelihood);
  }
}

void FasterBinLikelihood::evaluate_on_host(std::span<const BinBox> boxes,
                                           const KnownElements& elements,
                                           std::span<float> log_likelihood) const {
  struct Task {
    std::size_t first_box;
    std::size_t end_box;
    std::size_t first_bin;
    std::size_t bins;
  };
  // Large boxes are cut between rows: the bins of each part stand together.
  std::vector<BinBox> parts;
  std::vector<Task> tasks;
  Task task{};
  for (const BinBox& box : boxes) {
    const auto rows = static_cast<std::int32_t>(
        std::clamp<std::int64_t>(std::int64_t{task_bins} / box.x_count, 1, box.y_count));
    for (std::int32_t row = 0; row < box.y_count; row += rows) {
      BinBox part = box;
      part.y_first += row;
      part.y_count = std::min(rows, box.y_count - row);
      parts.push_back(part);
      task.bins += static_cast<std::size_t>(part.bins());
      if (task.bins >= task_bins) {
        task.end_box = parts.size();
        tasks.push_back(task);
        task = {task.end_box, 0, task.first_bin + task.bins, 0};
      }
    }
  }
  if (task.bins > 0) {
    task.end_box = parts.size();
    tasks.push_back(task);
  }
  parallel_for(tasks.size(), [&](std::size_t i) {
    const Task& of = tasks[i];
    host_.evaluate(std::span(parts).subspan(of.first_box, of.end_box - of.first_box), elements,
                   log_likelihood.subspan(of.first_bin, of.bins));
  });
}

void FasterBinLikelihood::measure(std::span<const BinBox> boxes, const KnownElements& elements,
                                  std::span<float> log_likelihood, double work) {
  const double host_s =
      seconds_of([&] { evaluate_on_host(boxes, elements, log_likelihood); }) / work;
  double start_s = 0.0;   // of any batch
  double device_s = 0.0;  // of an element and bin
  try {
    std::vector<float> again(log_likelihood.size());
    device();
    // A batch of one bin costs no more than its submission.
    BinBox one = boxes.front();
    one.y_count = one.x_count = 1;
    start_s = seconds_of(
        [&] { device().evaluate(std::span(&one, 1), elements, std::span(again).first(1)); });
    const double all_s = seconds_of([&] { device().evaluate(boxes, elements, again); });
    device_s = std::max(0.0, all_s - start_s) / work;
  } catch (const Error& error) {
    device_.reset();
    place_ = BinPlace::host;
    path_ = fmt::format("bins on the host: {}", error.what());
    log_message(LogLevel::warning, path_);
    return;
  }
  const double host_ns = 1e9 * host_s;
  const double device_ns = 1e9 * device_s;
  if (host_s <= device_s) {
    device_.reset();
    place_ = BinPlace::host;
    path_ = fmt::format("bins on the host: {:.2g} ns, device {:.2g} ns per element and bin",
                        host_ns, device_ns);
  } else {
    place_ = BinPlace::device;
    least_device_work_ = start_s / (host_s - device_s);
    path_ = fmt::format(
        "bins on the device, from {:.2g} elements times bins on: {:.2g} ns, host {:.2g} ns per "
        "element and bin",
        least_device_work_, device_ns, host_ns);
  }
}

double FasterBinLikelihood::float32_error(std::size_t object, const KnownElements& elements) const {
  const double on_host = host_.float32_error(object, elements);
  return place_ == BinPlace::host ? on_host
                                  : std::max(on_host, device_error_.nats(object, elements));
}

}  // namespace palpate
