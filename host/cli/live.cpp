#include <cerrno>
#include <chrono>
#include <csignal>
#include <cstdio>
#include <cstring>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <system_error>
#include <thread>
#include <utility>

#include <fmt/format.h>
#include <CLI/CLI.hpp>

#include "cli/command_files.hpp"
#include "cli/commands.hpp"
#include "cli/interruption.hpp"
#include "cli/options.hpp"
#include "cli/page/live_page.hpp"
#include "cli/recognition_flags.hpp"
#include "cli/record_table.hpp"
#include "cli/sensor_option.hpp"
#include "cli/step_words.hpp"
#include "palpate/virtual_sensor.hpp"
#include "recognition/live_recognition.hpp"
#include "recognition/record_json.hpp"

namespace palpate::cli {

namespace {

using namespace std::chrono_literals;

struct LiveArguments : SensorArguments {
  Request request;
  bool verbose = false;
  DetectorFlags detector;
  double tare_s = 0.5;
  std::optional<double> reset_after_s;
  std::string plan;
  std::string json;
  PageAddress page;
};

/// A file to which lines are added; other programs can read each line at once.
class LineFile {
 public:
  /// Replaces an older file; "-" is standard output. Throws Error.
  explicit LineFile(const std::string& path)
      : path_(path),
        file_(path == "-" ? stdout : std::fopen(path.c_str(), "we"),
              [](std::FILE* file) { return file == stdout ? 0 : std::fclose(file); }) {
    if (!file_) {
      refuse_flag("--json", path_, "cannot be made: {}", std::strerror(errno));
    }
  }
  /// Throws Error where the line cannot be written.
  void add(const std::string& line) const {
    if (std::fputs(line.c_str(), file_.get()) < 0 || std::fflush(file_.get()) != 0) {
      throw Error(Fault::system,
                  fmt::format("--json {}: cannot be written: {}", path_, std::strerror(errno)));
    }
  }

 private:
  std::string path_;
  std::unique_ptr<std::FILE, int (*)(std::FILE*)> file_;
};

/// Uses the recogniser once and forgets: the first touch pages memory in and may compile shaders,
/// for which no real touch should wait.
void warm_up(Recogniser& recogniser, const RecognitionTask& task, const SensorDescription& sensor,
             const std::vector<glm::dvec2>& elements_mm) {
  // In Contact and No Contact by turns, since Unknown elements are skipped.
  std::vector<double> pressure(elements_mm.size(), 0.0);
  for (std::size_t i = 0; i < pressure.size(); i += 2) {
    pressure[i] = 2.0 * task.classifier().threshold + 1.0;
  }
  const Touch touch{.T_robot_sensor = {},
                    .elements_mm = elements_mm,
                    .pressure = pressure,
                    .valid = sensor.valid};
  recogniser.update(std::span(&touch, 1));
  if (!traits_of(task.filter).certificate) {  // a search of one touch is long, compiles nothing
    recogniser.filter().refine(recogniser.estimate().mode);
  }
  recogniser.reset();
}

/// Says what is wrong with the frames' times and readings.
void judge_frames(const LiveState& state) {
  if (100 * state.frames_back > state.counters.frames) {  // a clock may be set back once
    tell_on_stderr(
        fmt::format("time runs backwards at {} of {} frames, each of which ends a touch; send the "
                    "frames in the order of their times",
                    state.frames_back, state.counters.frames));
  }
  // A sensor whose rest is taken in a press, too, reads below it for a while; frames out of order
  // are not smoothed.
  if (state.frames_back == 0 && 20 * state.frames_below > state.counters.frames) {
    tell_on_stderr(fmt::format(
        "the readings fall below their rest by more than the onset in {} of {} frames; if they "
        "fall under load, give --sign -1 to 'palpate import', or beside --sensor -",
        state.frames_below, state.counters.frames));
  }
}

void live(const LiveArguments& options) {
  if (options.reset_after_s) {
    require_above("--reset-after", *options.reset_after_s, 0.0);
  }
  const auto goal =
      options.plan.empty() ? std::nullopt : std::optional(parse_goal("plan", options.plan));
  require_above("--tare", options.tare_s, 0.0, true);
  const Request request = complete(options.request);
  if (options.poses.empty() && options.sensor != "-" && !is_virtual_sensor(options.sensor)) {
    refuse("--poses",
           "missing; sensor {} does not know where it is: give a file, a FIFO or - with the "
           "robot's poses",
           options.sensor);
  }
  // What is wrong with the poses, the lattice or the sensor, as it happens.
  std::mutex mutex;
  std::string last_finding;
  const auto tell = [&](const std::string& finding) {
    const std::lock_guard lock(mutex);
    last_finding = finding;
    tell_on_stderr(finding);
  };
  const OpenSensor opened = open_sensor(options, tell);
  const SensorDescription& description = opened.sensor->description();
  std::vector<glm::dvec2> elements_mm = description.elements_mm;
  const std::string source = "sensor " + options.sensor;
  replace_array(request, source, elements_mm.size(), elements_mm);
  const TouchDetectorOptions detector =
      detector_options(options.detector, description.pressure_unit, source);
  const RecognitionJob job(request, Circumstances{.pressure_unit = description.pressure_unit,
                                                  .source = source,
                                                  .reach_mm = array_reach_mm(elements_mm)});
  const RecognitionTask& task = job.task();
  if (goal && !traits_of(task.filter).bins) {
    refuse_flag("--plan", options.plan,
                "{}; use --filter bounded or --filter histogram, or leave it out", plan_needs);
  }
  CommandFiles files;
  add_sensor_files(options, files);
  add_recognition_files(request, files);
  files.writes("--json", options.json, CommandFiles::Dash::stream);
  files.require_distinct();
  Recogniser recogniser = open_telling(job);
  warm_up(recogniser, task, description, elements_mm);
  if (options.verbose) {
    print_engine(job, recogniser);
  }
  std::optional<LineFile> json;
  if (!options.json.empty()) {
    json.emplace(options.json);
  }

  // Where the reader of our output ends, writing fails with an error as on a full disk; SIGPIPE
  // would end the program silently.
  std::signal(SIGPIPE, SIG_IGN);
  const Interruption interruption;
  const bool to_program = options.json == "-";
  std::FILE* const people = to_program ? stderr : stdout;
  const auto show = [people](const std::string& text) {
    fmt::print(people, "{}", text);
    if (std::fflush(people) != 0) {  // nobody reads it any more
      throw std::system_error(errno, std::generic_category());
    }
  };
  std::optional<LivePage> page;
  if (options.page.port) {
    page.emplace(options.page, description, elements_mm, task, recogniser, goal);
    show(page->words() + "\n");
  }
  if (!to_program) {
    show(live_heading(task));
  }
  bool resolved = true;  // nothing was said yet
  LiveOptions settings{.detector = detector,
                       .tare_s = options.tare_s,
                       .reset_after_s = options.reset_after_s,
                       .plan = goal};
  settings.on_plan = [&](const LiveTouch& touch) {
    if (json) {
      json->add(plan_line(touch));
    }
    if (page) {
      page->plan(touch);
    }
    if (!to_program) {
      show("         " + next_touch_words(*touch.next, *goal) + "\n");
    }
  };
  settings.on_unknown = [&] {
    if (page) {
      page->begin_unknown();
    }
  };
  // Its thread alone uses the recogniser meanwhile.
  const auto on_touch = [&](const LiveTouch& touch) {
    const std::string unresolved = recogniser.unresolved_words();
    if (resolved && !unresolved.empty()) {
      resolved = false;
      tell(unresolved);
    }
    if (json) {
      json->add(text_of(to_json(touch, task)));
    }
    if (page) {
      page->add(touch);
    }
    if (!to_program) {
      show(live_line(touch, task));
    }
  };
  LiveRecognition recognition(*opened.sensor, elements_mm, recogniser, task, settings, on_touch);
  if (page) {
    page->serve(&recognition);
  }
  LiveState state;
  // A page stays to be looked at.
  while (!interruption.requested() && !recognition.failed()) {
    if (recognition.wait_for_end(40ms)) {
      if (!page) {
        break;
      }
      std::this_thread::sleep_for(40ms);
    }
    const LiveState before = std::exchange(state, recognition.state());
    if (state.taring && !before.taring) {
      tell_on_stderr("taring: do not touch the array");
    }
    if (state.gone != before.gone) {
      tell_on_stderr(state.gone ? "the board is unplugged; plug it in again to go on"
                                : "the board is back");
    }
    if (page) {
      const std::lock_guard lock(mutex);
      page->update(state, last_finding);
    }
  }
  if (page) {
    page->serve(nullptr);
  }
  recognition.finish();

  state = recognition.state();
  judge_frames(state);
  if (state.all_touches == 0 && state.without_pose > 0 && !interruption.requested()) {
    refuse(source, "none of its {} touches has a pose; {}", state.without_pose,
           !options.poses.empty()    ? "give --poses at the frames' times, in s since 1970"
           : opened.lines != nullptr ? "give --poses, or x_mm, y_mm and theta_rad in its lines"
                                     : "give --poses");
  }
  show(summary(state, recognition.latencies_ms(), task));
  if (!to_program) {
    show(setup_words(job) + "\n");
  }
  report_refused(opened);
}

}  // namespace

void add_live(CLI::App& app) {
  const auto [command, options] =
      add_command<LiveArguments>(app, "live",
                                 "Recognise what a sensor touches and find its pose in the robot "
                                 "frame, T_robot_object, with one standard deviation, a line for "
                                 "each touch, until Ctrl-C; --page shows the belief in a browser",
                                 live);
  add_sensor_flags(*command, *options,
                   " [default: the poses of the replay, of the simulation or of the lines]");
  add_recognition_flags(*command, options->request, options->verbose);
  add_detector_flags(*command, options->detector, "10; 0: the rest stays the baseline");
  add_with_default(*command, "--tare", options->tare_s,
                   "Seconds at the start in which nothing may touch the array and its baseline is "
                   "read, unless the sensor knows the baseline; 0: no baseline");
  command->add_option("--reset-after", options->reset_after_s,
                      "Seconds without contact after which the next touch is of another unknown "
                      "object [default: never]");
  command->add_option("--plan", options->plan,
                      "After each estimate, plan the next touch by this goal, identity, pose or "
                      "both: the best sensor pose of a grid about the places where the object may "
                      "be (see 'palpate plan') [default: no plan]");
  command->add_option("--json", options->json,
                      "Write a line of JSON for each touch as it comes, and with --plan a line "
                      "with \"next\" as soon as its plan is there; - is standard output");
  add_page_flags(*command, options->page);
  command->get_option("--page-address")->needs("--page");
}

}  // namespace palpate::cli
