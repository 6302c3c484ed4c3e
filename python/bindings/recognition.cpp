// `palpate recognize`, `palpate plan` and `palpate evaluate`.

#include <string>
#include <utility>
#include <vector>

#include <nanobind/stl/string_view.h>
#include <nanobind/stl/tuple.h>
#include <nanobind/stl/vector.h>

#include "arrays.hpp"
#include "bindings.hpp"
#include "model/option_words.hpp"
#include "recognition/judged_results.hpp"
#include "recognition/record_json.hpp"
#include "recognition/touch_plan.hpp"
#include "request.hpp"

namespace palpate::python {

using namespace nb::literals;

namespace {

using Json = nlohmann::ordered_json;
using Answer = std::pair<Json, Sentences>;

Sentences with_more(Sentences sentences, const std::string& more) {
  if (!more.empty()) {
    sentences.push_back(more);
  }
  return sentences;
}

/// The records, and what is worth a warning.
Answer recognize(const RecognitionJob& job, const Report& report) {
  const std::vector<Query>& unknowns = job.unknowns();
  const bool with_trace = job.request().trace;
  const RecognitionTask& task = job.task();
  Recogniser recogniser = job.open({.cancel_point = check_signals});
  Json records = Json::array();
  std::string unresolved;
  for (std::size_t i = 0; i < unknowns.size(); ++i) {
    const auto show = [&](double fraction) {
      report((static_cast<double>(i) + fraction) / static_cast<double>(unknowns.size()));
    };
    const RecognitionRecord record = recognise(recogniser, task, unknowns[i], with_trace, show);
    record.require_steps();
    if (unresolved.empty()) {
      unresolved = recogniser.unresolved_words();
    }
    records.push_back(to_json(record, task, job.device_name(), with_trace, in_keywords));
  }
  return {std::move(records), with_more(task.remarks, unresolved)};
}

/// The plan, and what is worth a warning.
Answer plan_next(const RecognitionJob& job, const PlanRequest& wanted, const Report& report) {
  const RecognitionTask& task = job.task();
  require_plannable(task);
  Recogniser recogniser = job.open({.cancel_point = check_signals});
  const Plan plan = plan_touch(recogniser, task, job.unknowns().front(), wanted, report);
  return {to_json(plan, task, job.device_name(), in_keywords),
          with_more(task.remarks, recogniser.unresolved_words())};
}

using Records = nb::typed<nb::list, Fields>;

std::tuple<Records, Sentences> recognize_python(nb::handle recordings, const PythonRequest& request,
                                                const Progress& progress) {
  const auto [records, sentences] = run_job(recordings, request, progress, &recognize);
  return {nb::borrow<Records>(to_python(records)), in_python(sentences)};
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
  const auto [plan, more] =
      run_job(recordings, request, progress, [&](const RecognitionJob& job, const Report& report) {
        return plan_next(job, wanted, report);
      });
  sentences.insert(sentences.end(), more.begin(), more.end());
  return {fields_of(plan), in_python(std::move(sentences))};
}

Fields evaluate_results(const std::vector<std::string>& paths, const nb::bytes& records) {
  const std::string text(records.c_str(), records.size());
  return fields_of(run([&] {
    JudgedResults results = read_results(result_files(paths));
    add_records("records", text, results);
    return to_json(evaluate(results, paths.empty() ? "records" : paths.front()), results);
  }));
}

}  // namespace

void bind_recognition(nb::module_& module) {
  module.def("recognize", &recognize_python, "recordings"_a, "request"_a, "progress"_a = nb::none(),
             "Records as in the JSON of `palpate recognize`, and what is worth a warning.");
  module.def("plan", &plan_python, "recordings"_a, "request"_a, "goal"_a, "candidates"_a,
             "samples"_a, "seed"_a, "progress"_a = nb::none(),
             "A plan as in the JSON of `palpate plan`, and what is worth a warning.");
  module.def("evaluate_results", &evaluate_results, "paths"_a, "records"_a,
             "The JSON of `palpate evaluate`, of files and folders of results, and of more records "
             "as a\nJSON array.");
}

}  // namespace palpate::python
