#include "cli/record_table.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <map>
#include <numeric>
#include <utility>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "cli/step_words.hpp"
#include "cli/text_table.hpp"
#include "model/printable.hpp"
#include "recognition/record_json.hpp"

namespace palpate::cli {

namespace {

/// Whether the pose is of the best label, and of no other.
bool is_of_best(const RecognitionStep& step, const RecognitionTask& task) {
  return task.labels[step.best] == task.labels[task.label_of[step.mode.object]];
}

// Cells of tables; "" where there is nothing to say.

/// "A", "A mirrored", "(none), pose of A".
std::string object_words(const RecognitionStep& step, const RecognitionTask& task) {
  const std::string object = task.name_of(step.mode.object);
  return is_of_best(step, task) ? object
                                : fmt::format("{}, pose of {}", task.labels[step.best], object);
}

/// "fits", "doubtful", "no fit" or "contradicted".
std::string fit_words(const RecognitionStep& step) {
  if (!step.contradicted && !step.fit) {
    return "";
  }
  return step.contradicted                            ? "contradicted"
         : step.fit->verdict == Verdict::does_not_fit ? "no fit"
                                                      : verdict_text(step.fit->verdict);
}

/// A probability.
std::string share_text(std::optional<double> share) {
  return share ? fmt::format("{:.3f}", *share) : "";
}

/// The columns of tables with a line for each touch.
/// @param dropped width of its column in lines by themselves
std::vector<TextTable::Column> step_columns(std::vector<TextTable::Column> first,
                                            const TextTable::Column& extra,
                                            std::size_t dropped = 0) {
  const std::vector<TextTable::Column> others{
      {"best", false, 10},     {"prob.", true, 5},    {"dropped", true, dropped},
      {"at pose", true, 7},    {"x mm", true, 14},    {"y mm", true, 14},
      {"theta deg", true, 15}, {"error mm", true, 8}, extra,
      {"touch's z", true, 9},  {"fit", false, 12}};
  first.insert(first.end(), others.begin(), others.end());
  return first;
}

/// A row below step_columns().
TextTable::Row step_cells(TextTable::Row first, const RecognitionStep& step,
                          const RecognitionTask& task, const std::string& extra) {
  const auto [x, y, theta] = pose_cells(step.T_robot_object(), sd_at_peak(step));
  const bool touch_fits = !step.touch_fit.empty() && step.touch_fit.back();
  first.insert(first.end(),
               {object_words(step, task), share_text(step.confidence()), dropped_text(step),
                share_text(share_at_pose(step, task)), x, y, theta,
                step.right ? error_text(step.pose_error_mm()) : "", extra,
                touch_fits ? fmt::format("{:+.1f}", *step.touch_fit.back()) : "", fit_words(step)});
  return first;
}

TextTable live_table(const RecognitionTask& task) {
  return TextTable(step_columns({{"unknown", true, 7}, {"touch", true, 5}},
                                {"latency ms", true, 10},
                                traits_of(task.filter).certificate ? 7 : 0));
}

std::string printable_name(const RecognitionRecord& record) { return printable(name_of(record)); }

/// Of more unknowns a line each would hide the table, where a column says on which to act.
constexpr std::size_t few_decided = 3;

bool is_decided(const RecognitionRecord& record) { return !record.last().decision.because.empty(); }

/// Whether to act on each of a few unknowns, or on how many of more.
std::string decisions(const std::vector<RecognitionRecord>& records, const RecognitionTask& task) {
  std::string text;
  std::size_t decided = 0;
  std::size_t acts = 0;
  for (const RecognitionRecord& record : records) {
    if (const std::string words = sentences_of(record.last(), task).decision; !words.empty()) {
      text += fmt::format("{}: {}\n", printable_name(record), words);
      ++decided;
      acts += record.last().decision.act ? 1 : 0;
    }
  }
  return decided > few_decided ? fmt::format("act on {} of {} unknowns\n", acts, decided) : text;
}

/// The probability of "(none)" where another label is the best; 0 where it is not among the labels.
double none_probability(const RecognitionStep& step, const RecognitionTask& task) {
  const bool other = task.labels.back() == none_label && step.best + 1 != task.labels.size();
  return other ? step.identity.back() : 0.0;
}

/// How many unknowns of a known truth are right, and their mean pose errors.
std::string summary(const std::vector<RecognitionRecord>& records) {
  int known = 0;
  int right = 0;
  int located = 0;
  double mode_sum = 0.0;
  double refined_sum = 0.0;
  for (const RecognitionRecord& record : records) {
    const RecognitionStep& step = record.last();
    known += step.right ? 1 : 0;
    right += step.right.value_or(false) ? 1 : 0;
    located += step.error_mm ? 1 : 0;
    mode_sum += step.error_mm.value_or(0.0);
    refined_sum += step.refined_error_mm.value_or(0.0);
  }
  if (known == 0) {
    return "";
  }
  std::string text = fmt::format("{} of {} right ({:.1f} %)", right, known, 100.0 * right / known);
  if (located > 0) {
    text += "; mean error of ";
    if (records.front().last().refined) {
      text += fmt::format("refined poses {:.2f} mm, of ", refined_sum / located);
    }
    text += fmt::format("modes {:.2f} mm", mode_sum / located);
  }
  return text + "\n";
}

/// Within which angles theta of symmetric objects is given, once for each label. Touches may tell
/// the turns of a map that looks alike apart.
std::string symmetries(const std::vector<RecognitionRecord>& records, const RecognitionTask& task) {
  std::map<std::string, std::map<int, int>> records_of;  // [label, symmetry]
  for (const RecognitionRecord& record : records) {
    const RecognitionStep& step = record.last();
    ++records_of[task.labels[task.label_of[step.mode.object]]][step.symmetry];
  }
  std::string text;
  for (const auto& [label, counts] : records_of) {
    for (const auto& [n, count] : counts) {
      if (n == 1) {
        continue;
      }
      const std::string whose =
          counts.size() == 1
              ? ": its"
              : fmt::format(", as far as the touches of {} of these unknowns tell: their", count);
      text += fmt::format(
          "{} looks the same after {}{} theta is given {}\n", printable(label),
          n == 0 ? "any turn" : fmt::format("every 1/{} of a turn", n), whose,
          n == 0 ? "as 0" : fmt::format("from {:.4g} to {:.4g} deg", -180.0 / n, 180.0 / n));
    }
  }
  return text;
}

}  // namespace

std::string dropped_text(const RecognitionStep& step) {
  if (!step.certificate) {
    return "";
  }
  const double mass = step.certificate->dropped_mass;
  if (!(mass > 0.0)) {
    return "0";
  }
  const double digit = std::pow(10.0, std::floor(std::log10(mass)));
  // A number that has one digit keeps it, whatever the division's rounding.
  const double rounded = digit * std::ceil(mass / digit * (1.0 - 1e-12));
  return fmt::format("{:.1g}", std::min(rounded, 1.0));
}

std::string name_of(const RecognitionRecord& record) {
  const std::string file = std::filesystem::path(record.recording).filename().string();
  return record.frame ? fmt::format("{} frame {}", file, *record.frame) : file;
}

std::string trace_table(const RecognitionRecord& record, const RecognitionTask& task) {
  TextTable table(step_columns({{"  touch", true}}, {"effective particles", true}));
  for (std::size_t i = 0; i < record.trace.size(); ++i) {
    const auto& particles = record.trace[i].effective_sample_size;
    table.add(step_cells({fmt::format("{}", i + 1)}, record.trace[i], task,
                         particles ? fmt::format("{:.1f}", *particles) : ""));
  }
  const std::string truth = sentences_of(record.last(), task).truth;
  return printable_name(record) + "\n" + table.text() + (truth.empty() ? "" : "  " + truth + "\n");
}

std::string findings(const std::vector<RecognitionRecord>& records, const RecognitionTask& task) {
  constexpr std::size_t most_names = 3;
  std::vector<std::pair<std::string, std::vector<std::string>>> names_of;  // [finding]
  std::map<std::string, std::size_t> index_of;
  for (const RecognitionRecord& record : records) {
    for (const std::string& finding : sentences_of(record.last(), task).findings) {
      const auto [known, is_new] = index_of.try_emplace(finding, names_of.size());
      if (is_new) {
        names_of.push_back({finding, {}});
      }
      names_of[known->second].second.push_back(printable_name(record));
    }
  }
  std::string text;
  for (auto& [finding, names] : names_of) {
    const std::size_t more = names.size() - std::min(names.size(), most_names);
    names.resize(names.size() - more);
    text += fmt::format("{}{}: {}\n", fmt::join(names, ", "),
                        more > 0 ? fmt::format(" and {} more", more) : "", finding);
  }
  return text;
}

std::string result_table(const std::vector<RecognitionRecord>& records,
                         const RecognitionTask& task) {
  const bool with_fit = std::ranges::any_of(
      records, [](const RecognitionRecord& record) { return !fit_words(record.last()).empty(); });
  const bool with_error = std::ranges::any_of(
      records, [](const RecognitionRecord& record) { return record.last().right.has_value(); });
  const bool with_act = std::ranges::count_if(records, is_decided) > std::ptrdiff_t{few_decided};
  TextTable table({{"recording"},
                   {"touches", true},
                   {"act"},
                   {"best"},
                   {"prob.", true},
                   {"dropped", true},
                   {"x mm", true},
                   {"y mm", true},
                   {"theta deg", true},
                   {fmt::format("{}{}{}", with_fit ? "fit" : "", with_fit && with_error ? ", " : "",
                                with_error ? "error" : ""),
                    false}});
  using Row = TextTable::Row;
  const auto line = [](const std::string& what, const std::string& label,
                       std::optional<double> probability, const std::optional<Pose>& T_robot_object,
                       const StandardDeviations& sd, const std::string& last) -> Row {
    const auto [x, y, theta] =
        T_robot_object ? pose_cells(*T_robot_object, sd) : std::array<std::string, 3>{};
    return {what, "", "", label, share_text(probability), "", x, y, theta, last};
  };
  const auto off = [](std::optional<double> error_mm) {
    return error_mm ? fmt::format("{:.2f} mm off", *error_mm) : "";
  };
  for (const RecognitionRecord& record : records) {
    const RecognitionStep& step = record.last();
    const std::string posed = task.name_of(step.mode.object);
    const std::optional<double> share = share_at_pose(step, task);  // less than the best label's
    const std::optional<Pose> pose = step.T_robot_object();
    Row row = line(name_of(record), is_of_best(step, task) ? posed : task.labels[step.best],
                   step.confidence(), share ? std::nullopt : pose, sd_at_peak(step),
                   share ? "" : fit_words(step));
    row[1] = fmt::format("{}", record.touches);
    row[2] = !with_act ? "" : step.decision.act ? "act" : "-";
    row[5] = dropped_text(step);
    table.add(row);
    if (share) {
      table.add(line("  pose", posed, share, pose, sd_at_peak(step), fit_words(step)));
    }
    for (const BeliefMode& mode : other_modes(step)) {
      table.add(line("  or", task.name_of(mode.object), mode.probability, mode.pose.T_robot_object,
                     mode.pose.sd(), ""));
    }
    if (const double none = none_probability(step, task); none >= 0.01) {
      table.add(line("  or", std::string(none_label), none, {}, {}, ""));
    }
    if (step.refined) {
      table.add(line("  mode", posed, {}, step.mode_T_robot_object(), {}, off(step.error_mm)));
    }
    if (const std::optional<Pose> truth = step.true_T_robot_object()) {
      table.add(line("  truth", step.truth.label, {}, truth, {}, off(step.pose_error_mm())));
    } else if (step.right == false) {
      table.add(line("  truth", step.truth.label, {}, {}, {}, "wrong object"));
    }
  }
  return decisions(records, task) + table.text() + findings(records, task) +
         symmetries(records, task) + summary(records);
}

std::string live_heading(const RecognitionTask& task) {
  const TextTable table = live_table(task);
  return table.line(table.headings());
}

std::string live_line(const LiveTouch& touch, const RecognitionTask& task) {
  TextTable::Row row =
      step_cells({fmt::format("{}", touch.unknown + 1), fmt::format("{}", touch.index + 1)},
                 touch.step, task, fmt::format("{:.2f}", touch.latency_ms));
  std::ranges::replace(row, std::string(), "-");
  row.back() += touch.step.decision.act ? ", act" : "";  // "fit" is last
  return live_table(task).line(row);
}

std::string summary(const LiveState& state, std::vector<double> latencies_ms,
                    const RecognitionTask& task) {
  std::string text;
  if (state.last) {
    const RecognitionStep& step = state.last->step;
    const StepSentences words = sentences_of(step, task);
    std::vector<std::string> lines{words.decision, result_words(step, task), words.truth};
    std::ranges::copy(words.findings, std::back_inserter(lines));
    for (const std::string& line : lines) {
      text += line.empty() ? "" : line + "\n";
    }
  }
  text += fmt::format("{} touches, {} frames, {} lost", state.all_touches, state.counters.frames,
                      state.counters.lost);
  if (state.counters.reconnects > 0) {
    text += fmt::format(", the board came back {} times", state.counters.reconnects);
  }
  text += also(state.without_pose, "touches without a pose passed over") +
          also(state.unknown_readings, "readings unknown") + "\n";
  if (!latencies_ms.empty()) {
    std::ranges::sort(latencies_ms);
    const std::size_t n = latencies_ms.size();
    text += fmt::format("from frame to estimate: median {:.2f} ms, worst {:.2f} ms\n",
                        std::midpoint(latencies_ms[(n - 1) / 2], latencies_ms[n / 2]),
                        state.worst_latency_ms);
  }
  return text;
}

}  // namespace palpate::cli
