// `palpate recognize` and `palpate plan`.

#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <nanobind/stl/string_view.h>
#include <nanobind/stl/tuple.h>
#include <nanobind/stl/vector.h>
#include <nlohmann/json.hpp>

#include "bindings.hpp"
#include "estimate.hpp"
#include "model/option_words.hpp"
#include "recognition/record_json.hpp"
#include "recognition/touch_plan.hpp"
#include "request.hpp"

namespace palpate::python {

using namespace nb::literals;

namespace {

using Json = nlohmann::ordered_json;

nb::object to_python(const Json& json) {
  switch (json.type()) {
    case Json::value_t::object: {
      nb::dict result;
      for (const auto& [key, value] : json.items()) {
        result[key.c_str()] = to_python(value);
      }
      return result;
    }
    case Json::value_t::array: {
      nb::list result;
      for (const Json& value : json) {
        result.append(to_python(value));
      }
      return result;
    }
    case Json::value_t::string: {
      const auto& text = json.get_ref<const std::string&>();
      // The path of a recording need not be UTF-8.
      return nb::steal(
          PyUnicode_DecodeFSDefaultAndSize(text.data(), static_cast<Py_ssize_t>(text.size())));
    }
    case Json::value_t::boolean:
      return nb::bool_(json.get<bool>());
    case Json::value_t::number_integer:
    case Json::value_t::number_unsigned:
      return nb::int_(json.get<std::int64_t>());
    case Json::value_t::number_float:
      return nb::float_(json.get<double>());
    default:
      return nb::none();
  }
}

struct Answer {
  Json records = Json::array();
  Sentences sentences;
};

Answer recognize(const RecognitionJob& job, Call& call) {
  const std::function<void(double)> progress = call.progress();
  const std::vector<Query>& unknowns = job.unknowns();
  const bool with_trace = job.request().trace;
  const RecognitionTask& task = job.task();
  Recogniser recogniser = job.open({.cancel_point = [&call] { call.check(); }});
  Answer answer{.sentences = task.remarks};
  std::string unresolved;
  for (std::size_t i = 0; i < unknowns.size(); ++i) {
    const auto show = [&](double fraction) {
      progress((static_cast<double>(i) + fraction) / static_cast<double>(unknowns.size()));
    };
    const RecognitionRecord record = recognise(recogniser, task, unknowns[i], with_trace, show);
    record.require_steps();
    if (unresolved.empty()) {
      unresolved = recogniser.unresolved_words();
    }
    answer.records.push_back(to_json(record, task, job.device_name(), with_trace, in_keywords));
  }
  if (!unresolved.empty()) {
    answer.sentences.push_back(unresolved);
  }
  return answer;
}

using Fields = nb::typed<nb::dict, nb::str, nb::any>;
using Records = nb::typed<nb::list, Fields>;

std::tuple<Records, Sentences> recognize_python(nb::handle recordings, const PythonRequest& request,
                                                const Progress& progress) {
  const Answer answer = run_job(recordings, request, progress, &recognize);
  return {nb::borrow<Records>(to_python(answer.records)), in_python(answer.sentences)};
}

/// A plan, with what is believed as JSON.
struct Planned {
  Plan plan;
  std::string believed;
  std::string device;
  Sentences told;
};

Planned plan_next(const RecognitionJob& job, const PlanRequest& wanted, Call& call) {
  Planned planned;
  const RecognitionTask& task = job.task();
  require_plannable(task);
  planned.device = job.device_name();
  Recogniser recogniser = job.open({.cancel_point = [&call] { call.check(); }});
  planned.told = task.remarks;
  planned.plan = plan_touch(recogniser, task, job.unknowns().front(), wanted, call.progress());
  if (const std::string words = recogniser.unresolved_words(); !words.empty()) {
    planned.told.push_back(words);
  }
  planned.believed = palpate::text_of(to_json(planned.plan.record.last(), task, in_keywords));
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
  auto [wanted, sentences] = run([=](Call&) {
    Sentences told;
    PlanRequest read = plan_request(goal, source, samples, seed,
                                    [&](const std::string& sentence) { told.push_back(sentence); });
    return std::pair(std::move(read), std::move(told));
  });
  if (!poses.empty()) {
    wanted.candidates = poses;
  }
  const Planned planned =
      run_job(recordings, request, progress,
              [wanted = std::move(wanted)](const RecognitionJob& job, Call& call) {
                return plan_next(job, wanted, call);
              });
  sentences.insert(sentences.end(), planned.told.begin(), planned.told.end());
  const Plan& plan = planned.plan;
  TouchGains gains;
  std::vector<std::uint64_t> index;
  poses.clear();
  for (const PlannedTouch& touch : plan.ranked) {
    gains.each.push_back(touch.gain);
    index.push_back(touch.index);
    poses.push_back(touch.T_robot_sensor);
  }
  Fields result;
  result["recording"] = plan.record.recording;
  result["touches"] = plan.record.touches;
  result["goal"] = goal_word(plan.goal);
  result["believed"] = nb::bytes(planned.believed.data(), planned.believed.size());
  result["identity_nats"] = plan.identity_nats;
  result["pose_nats"] = plan.both_nats - plan.identity_nats;
  result["index"] = owned(std::move(index));
  result["T_robot_sensor"] = to_array(poses);
  result["gains"] = nb::cast(std::move(gains));
  result["warnings"] = in_python(warnings_of(plan));
  result["samples"] = plan.samples.size();
  result["seed"] = plan.seed;
  result["seconds"] = plan.seconds;
  result["device"] = planned.device;
  return {result, in_python(std::move(sentences))};
}

}  // namespace

void bind_recognition(nb::module_& module) {
  module.def("recognize", &recognize_python, "recordings"_a, "request"_a, "progress"_a = nb::none(),
             "Records as in the JSON of `palpate recognize`, and what is worth a warning.");
  module.def("plan", &plan_python, "recordings"_a, "request"_a, "goal"_a, "candidates"_a,
             "samples"_a, "seed"_a, "progress"_a = nb::none(),
             "The fields of a plan, and what is worth a warning.");
}

}  // namespace palpate::python
