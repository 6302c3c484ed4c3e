// `palpate recognize` and `palpate plan`.

#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <nanobind/stl/string_view.h>
#include <nanobind/stl/tuple.h>
#include <nanobind/stl/vector.h>

#include "bindings.hpp"
#include "estimate.hpp"
#include "json.hpp"
#include "model/option_words.hpp"
#include "recognition/record_json.hpp"
#include "recognition/recordings.hpp"
#include "recognition/resolve.hpp"
#include "recognition/result_json.hpp"
#include "recognition/touch_plan.hpp"
#include "request.hpp"

namespace palpate::python {

using namespace nb::literals;

namespace {

struct Answer {
  nlohmann::ordered_json records = nlohmann::ordered_json::array();
  Sentences sentences;
};

/// Name of the device that the task's filter computes on.
std::string name_of_used(const Device& device, const RecognitionTask& task) {
  return uses_device(task) ? device.name() : "none";
}

Answer recognize(const Subject& subject, Device& device, const Report& report) {
  Answer answer;
  const std::vector<Unknown>& unknowns = subject.unknowns;
  const bool with_trace = subject.request.trace;
  const RecognitionTask task = task_of(subject, device);
  Recogniser recogniser = open_recogniser(&device, task, {.cancel_point = check_signals});
  answer.sentences = task.remarks;
  std::string unresolved;
  for (std::size_t i = 0; i < unknowns.size(); ++i) {
    const auto show = [&](double fraction) {
      report((static_cast<double>(i) + fraction) / static_cast<double>(unknowns.size()));
    };
    const RecognitionRecord record = recognise(recogniser, task, unknowns[i], with_trace, show);
    record.require_steps();
    if (unresolved.empty()) {
      unresolved = unresolved_words(task, recogniser.lattice(), unknowns[i].touches);
    }
    answer.records.push_back(
        to_json(record, task, name_of_used(device, task), with_trace, in_keywords));
  }
  if (!unresolved.empty()) {
    answer.sentences.push_back(unresolved);
  }
  return answer;
}

using Records = nb::typed<nb::list, Fields>;

std::tuple<Records, Sentences> recognize_python(nb::handle recordings, const PythonRequest& request,
                                                const Progress& progress) {
  const Answer answer = run_on_subject(recordings, request, progress, &recognize);
  return {nb::borrow<Records>(to_python(answer.records)), in_python(answer.sentences)};
}

struct Planned {
  nlohmann::ordered_json plan;
  Sentences told;
};

Planned plan_next(const Subject& subject, const PlanRequest& wanted, Device& device,
                  const Report& report) {
  Planned planned;
  const Unknown& unknown = subject.unknowns.front();
  const RecognitionTask task =
      resolve(subject.request, {.pressure_unit = subject.recordings.front().pressure_unit,
                                .source = unknown.recording,
                                .reach_mm = largest_reach_mm(unknown.touches),
                                .device = [&]() -> Device& { return device; }});
  require_plannable(task);
  Recogniser recogniser = open_recogniser(&device, task, {.cancel_point = check_signals});
  planned.told = task.remarks;
  const Plan plan = plan_touch(recogniser, task, unknown, wanted, report);
  if (const std::string words = unresolved_words(task, recogniser.lattice(), unknown.touches);
      !words.empty()) {
    planned.told.push_back(words);
  }
  planned.plan = to_json(plan, task, name_of_used(device, task), in_keywords);
  return planned;
}

std::tuple<Fields, Sentences> plan_python(nb::handle recordings, const PythonRequest& request,
                                          const std::string& goal, nb::handle candidates,
                                          std::size_t samples, std::uint64_t seed,
                                          const Progress& progress) {
  std::string source = candidate_grid_word;  // where `poses` are given
  std::vector<Pose> poses;                   // T_robot_sensor
  if (is_path(candidates.ptr())) {
    source = nb::borrow<PathLike>(candidates).text();
  } else {
    poses = poses_of(candidates, "candidates");
    require_reachable("candidates", poses);
  }
  Sentences sentences;
  PlanRequest wanted = run([&] {
    return plan_request(goal, source, samples, seed,
                        [&](const std::string& sentence) { sentences.push_back(sentence); });
  });
  if (!poses.empty()) {
    wanted.candidates = std::move(poses);
  }
  const Planned planned =
      run_on_subject(recordings, request, progress,
                     [&](const Subject& subject, Device& device, const Report& report) {
                       return plan_next(subject, wanted, device, report);
                     });
  sentences.insert(sentences.end(), planned.told.begin(), planned.told.end());
  return {fields_of(planned.plan), in_python(std::move(sentences))};
}

}  // namespace

void bind_recognition(nb::module_& module) {
  module.def("recognize", &recognize_python, "recordings"_a, "request"_a, "progress"_a = nb::none(),
             "Records as in the JSON of `palpate recognize`, and what is worth a warning.");
  module.def("plan", &plan_python, "recordings"_a, "request"_a, "goal"_a, "candidates"_a,
             "samples"_a, "seed"_a, "progress"_a = nb::none(),
             "A plan as in the JSON of `palpate plan`, and what is worth a warning.");
}

}  // namespace palpate::python
