// `palpate plan` and `palpate recognize --fit-touch-sd`, for palpate/commands.py.

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <nanobind/stl/shared_ptr.h>
#include <nanobind/stl/string_view.h>
#include <nanobind/stl/tuple.h>
#include <nanobind/stl/vector.h>

#include "bindings.hpp"
#include "estimate.hpp"
#include "given_recordings.hpp"
#include "model/option_words.hpp"
#include "recognition/record_json.hpp"
#include "recognition/resolve.hpp"
#include "recognition/touch_plan.hpp"
#include "recognition/touch_sd_fit.hpp"
#include "recognition/unknowns.hpp"

namespace palpate::python {

using namespace nb::literals;

namespace {

using Told = std::vector<std::string>;  // what is worth a warning

/// A plan, with what is believed as JSON.
struct Planned {
  Plan plan;
  std::string believed;
  std::string device;
  Told told;
};

/// What of a plan is asked beside what it is about.
struct PlanWish {
  std::string goal;
  std::string candidates;   ///< of the command; candidate_grid_word where `poses` are given
  std::vector<Pose> poses;  ///< T_robot_sensor
  std::size_t samples;
  std::uint64_t seed;
};

Planned plan_next(const GivenRecordings& given, const Request& request, const PlanWish& wish,
                  const std::shared_ptr<Session>& session, Call& call) {
  Planned planned;
  const auto tell = [&](const std::string& sentence) {
    planned.told.push_back(in_keywords(sentence));
  };
  PlanRequest wanted = plan_request(wish.goal, wish.candidates, wish.samples, wish.seed, tell);
  if (!wish.poses.empty()) {
    wanted.candidates = wish.poses;
  }
  const Subject subject = subject_of(given, request);
  const Unknown& unknown = subject.unknowns.front();
  const auto used = session_on(session, subject.request.device);
  auto lock = used->lock(call);
  const RecognitionTask task =
      resolve(subject.request, {.pressure_unit = subject.recordings.front().pressure_unit,
                                .source = unknown.recording,
                                .reach_mm = largest_reach_mm(unknown.touches),
                                .need = {.why = plan_needs},
                                .cancel_point = [&call] { call.check(); },
                                .device = [&]() -> const Device& { return lock.device(); }});
  require_histogram(task);
  Recogniser recogniser = open_recogniser(lock.device(), task);
  std::ranges::for_each(task.remarks, tell);
  planned.plan = plan_touch(recogniser, task, unknown, wanted, call.progress());
  if (const std::string words = unresolved_words(task, recogniser.lattice(), unknown.touches);
      !words.empty()) {
    tell(words);
  }
  planned.believed = palpate::text_of(to_json(planned.plan.record.last(), task, in_keywords));
  planned.device = used->name();
  return planned;
}

nb::tuple plan_python(const nb::list& recordings, const nb::list& maps, Request request,
                      const std::string& goal, nb::handle candidates, std::size_t samples,
                      std::uint64_t seed, const std::shared_ptr<Session>& session,
                      const Progress& progress) {
  const GivenRecordings given = given_recordings(recordings);
  add_maps(maps, request);
  PlanWish wish{goal, candidate_grid_word, {}, samples, seed};
  if (nb::isinstance<nb::str>(candidates)) {
    wish.candidates = nb::cast<std::string>(candidates);
  } else {
    wish.poses = poses_of(candidates, "candidates");
    require_reachable("candidates", wish.poses);
  }
  const Planned planned =
      run({}, progress, [=](Call& call) { return plan_next(given, request, wish, session, call); });
  const Plan& plan = planned.plan;
  TouchGains gains;
  std::vector<std::uint64_t> index;
  std::vector<Pose> poses;
  for (const PlannedTouch& touch : plan.ranked) {
    gains.each.push_back(touch.gain);
    index.push_back(touch.index);
    poses.push_back(touch.T_robot_sensor);
  }
  nb::dict result;
  result["recording"] = plan.record.recording;
  result["touches"] = plan.record.touches;
  result["goal"] = goal_word(plan.goal);
  result["believed"] = nb::bytes(planned.believed.data(), planned.believed.size());
  result["identity_nats"] = plan.identity_nats;
  result["pose_nats"] = plan.both_nats - plan.identity_nats;
  result["index"] = owned(std::move(index));
  result["T_robot_sensor"] = to_array(poses);
  result["gains"] = nb::cast(std::move(gains));
  std::vector<std::string> warnings = warnings_of(plan);
  std::ranges::transform(warnings, warnings.begin(), in_keywords);
  result["warnings"] = warnings;
  result["samples"] = plan.samples.size();
  result["seed"] = plan.seed;
  result["seconds"] = plan.seconds;
  result["device"] = planned.device;
  return nb::make_tuple(result, planned.told);
}

using Fitted = std::tuple<TouchSdFit, Told>;

Fitted fit_recordings(const GivenRecordings& given, const Request& request,
                      const std::shared_ptr<Session>& session, Call& call) {
  const Subject subject = subject_of(given, request);
  const Recording& first = subject.recordings.front();
  const auto used = session_on(session, subject.request.device);
  auto lock = used->lock(call);
  const RecognitionTask task =
      resolve(subject.request, {.pressure_unit = first.pressure_unit,
                                .source = first.path,
                                .reach_mm = largest_reach_mm(subject.recordings),
                                .still_array = array_is_still(subject.unknowns),
                                .need = {"fit-touch-sd", touch_sd_fit_needs},
                                .device = [&]() -> const Device& { return lock.device(); }});
  require_fittable(task);
  TouchSdFit fit =
      fit_touch_sd(lock.device(), task, touched_objects(subject.recordings, subject.unknowns, task),
                   {}, call.progress());
  Told told;
  std::ranges::transform(task.remarks, std::back_inserter(told), in_keywords);
  return {std::move(fit), std::move(told)};
}

Fitted fit_python(const nb::list& recordings, const nb::list& maps, Request request,
                  const std::shared_ptr<Session>& session, const Progress& progress) {
  const GivenRecordings given = given_recordings(recordings);
  add_maps(maps, request);
  return run({}, progress,
             [=](Call& call) { return fit_recordings(given, request, session, call); });
}

void bind_touch_sd_fit(nb::module_& module) {
  nb::class_<TouchSdFit>(module, "TouchSdFit",
                         "Standard deviations of the touches' poses about the poses that the robot "
                         "reported.")
      .def_ro("sd", &TouchSdFit::sd,
              "For PoseHistogram(touch_sd=...); 0: not distinguishable from 0, given the maps.")
      .def_ro("standard_error", &TouchSdFit::standard_error, "Of sd; 0 where sd is 0.")
      .def_ro("resolution", &TouchSdFit::resolution, "Below about this, sd cannot be told from 0.")
      .def_ro("evidence_gain", &TouchSdFit::evidence_gain,
              "By how much the log evidence exceeds that of exact poses, nats.")
      .def_ro("unknowns", &TouchSdFit::unknowns, "How many recordings were used.")
      .def_ro("touches", &TouchSdFit::touches, "How many touches were used.")
      .def_ro("warnings", &TouchSdFit::warnings, "Why the result may be far off, in sentences.")
      .def("__repr__", [](const TouchSdFit& self) {
        return fmt::format("TouchSdFit({:.3g} +- {:.2g} mm, {:.3g} +- {:.2g} rad)", self.sd.mm,
                           self.standard_error.mm, self.sd.rad, self.standard_error.rad);
      });
}

}  // namespace

void bind_plan(nb::module_& module) {
  module.def("plan", &plan_python, "recordings"_a, "maps"_a, "request"_a, "goal"_a, "candidates"_a,
             "samples"_a, "seed"_a, "device"_a = nb::none(), "progress"_a = nb::none(),
             nb::sig("def plan(recordings: list[Recording | str], maps: "
                     "list[OccupancyGrid | Hypothesis | str], request: Request, goal: str, "
                     "candidates: object, samples: int, seed: int, device: Device | None = None, "
                     "progress: collections.abc.Callable[[float], object] | None = None) -> "
                     "tuple[dict[str, typing.Any], list[str]]"),
             "The fields of a plan, and what is worth a warning.");
  bind_touch_sd_fit(module);
  module.def("fit_touch_sd", &fit_python, "recordings"_a, "maps"_a, "request"_a,
             "device"_a = nb::none(), "progress"_a = nb::none(),
             nb::sig("def fit_touch_sd(recordings: list[Recording | str], maps: "
                     "list[OccupancyGrid | Hypothesis | str], request: Request, device: "
                     "Device | None = None, progress: collections.abc.Callable[[float], object] | "
                     "None = None) -> tuple[TouchSdFit, list[str]]"),
             "The fit, and what is worth a warning.");
}

}  // namespace palpate::python
