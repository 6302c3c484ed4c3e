#include "cli/record_table.hpp"

#include <algorithm>
#include <filesystem>
#include <map>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "cli/step_words.hpp"
#include "cli/text_table.hpp"
#include "model/printable.hpp"

namespace palpate::cli {

namespace {

using Column = TextTable::Column;

std::string printable_name(const RecognitionRecord& record) { return printable(name_of(record)); }

/// What the labels that were not always right were taken for, most often first.
std::string confusions(const std::vector<RecognitionRecord>& records, const RecognitionTask& task) {
  struct Row {
    int all = 0;
    int right = 0;
    std::map<std::string, int> wrong;
  };
  std::map<std::string, Row> rows;
  for (const RecognitionRecord& record : records) {
    if (const auto right = record.last().right) {
      Row& row = rows[record.true_label];
      ++row.all;
      ++(*right ? row.right : row.wrong[task.labels[record.last().best]]);
    }
  }
  if (std::all_of(rows.begin(), rows.end(),
                  [](const auto& row) { return row.second.right == row.second.all; })) {
    return "";
  }
  std::string text = fmt::format("\n{:<16} {:>9}  taken for\n", "object", "right");
  for (const auto& [label, row] : rows) {
    std::vector<std::pair<int, std::string>> wrong;
    for (const auto& [other, count] : row.wrong) {
      wrong.emplace_back(-count, other);
    }
    std::sort(wrong.begin(), wrong.end());
    std::string list;
    for (const auto& [count, other] : wrong) {
      list += fmt::format("{}{} {}", list.empty() ? "" : ", ", -count, printable(other));
    }
    text += fmt::format("{:<16} {:>4} of {:<2}  {}\n", printable(label), row.right, row.all, list);
  }
  return text;
}

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

/// The best label, and "mirrored" where the pose is of its other side.
std::string best_words(const RecognitionStep& step, const RecognitionTask& task) {
  const std::string& best = task.labels[step.best];
  const bool posed = best == task.labels[task.label_of[step.mode.object]];
  return printable(posed ? task.name_of(step.mode.object) : best);
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

/// Within which angles theta of symmetric objects is given, once for each label.
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
      // Touches may tell the turns of a map that looks alike apart.
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

std::string name_of(const RecognitionRecord& record) {
  const std::string file = std::filesystem::path(record.recording).filename().string();
  return record.frame ? fmt::format("{} frame {}", file, *record.frame) : file;
}

std::string trace_table(const RecognitionRecord& record, const RecognitionTask& task) {
  TextTable table({{"  touch", true},
                   {"best"},
                   {"prob.", true},
                   {"dropped", true},
                   {"at pose", true},
                   {"x mm", true},
                   {"y mm", true},
                   {"theta deg", true},
                   {"error mm", true},
                   {"effective particles", true},
                   {"touch's z", true},
                   {"fit"}});
  for (std::size_t i = 0; i < record.trace.size(); ++i) {
    const RecognitionStep& step = record.trace[i];
    const std::array<std::string, 3> pose = pose_cells(pose_text(step));
    const auto& particles = step.effective_sample_size;
    table.add({fmt::format("{}", i + 1), object_words(step, task),
               fmt::format("{:.3f}", step.confidence()), dropped_text(step), share_text(step, task),
               pose[0], pose[1], pose[2], step.right ? error_text(step.pose_error_mm()) : "",
               particles ? fmt::format("{:.1f}", *particles) : "", touch_fit_text(step),
               fit_words(step)});
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
  const auto add_pose = [&](const char* what, const std::string& label, const Pose& T_robot_object,
                            std::optional<double> error_mm) {
    const PoseText pose = pose_text(T_robot_object);
    table.add({what, "", "", label, "", "", pose.value[0], pose.value[1], pose.value[2],
               error_mm ? fmt::format("{:.2f} mm off", *error_mm) : ""});
  };
  for (const RecognitionRecord& record : records) {
    const RecognitionStep& step = record.last();
    const std::array<std::string, 3> pose = pose_cells(pose_text(step));
    const std::string act = !with_act ? "" : step.decision.act ? "act" : "-";
    const std::string share = share_text(step, task);
    std::vector<std::string> row{
        name_of(record),        fmt::format("{}", record.touches),        act,
        best_words(step, task), fmt::format("{:.3f}", step.confidence()), dropped_text(step)};
    if (!share.empty()) {  // the pose has not the probability of the best label
      row.insert(row.end(), 4, "");
      table.add(row);
      row = {"  pose", "", "", printable(task.name_of(step.mode.object)), share, ""};
    }
    row.insert(row.end(), {pose[0], pose[1], pose[2], fit_words(step)});
    table.add(row);
    for (const BeliefMode& mode : other_modes(step)) {
      const std::array<std::string, 3> there =
          pose_cells(pose_text(mode.pose.T_robot_object, mode.pose.sd()));
      table.add({"  or", "", "", printable(task.name_of(mode.object)),
                 fmt::format("{:.3f}", mode.probability), "", there[0], there[1], there[2], ""});
    }
    if (const double none = none_probability(step, task); none >= 0.01) {
      table.add({"  or", "", "", std::string(none_label), fmt::format("{:.3f}", none), "", "", "",
                 "", ""});
    }
    if (step.refined) {
      add_pose("  mode", task.name_of(step.mode.object), step.mode_T_robot_object(), step.error_mm);
    }
    if (const std::optional<Pose> truth = step.true_T_robot_object()) {
      add_pose("  truth", step.truth.label, *truth, step.pose_error_mm());
    } else if (step.right == false) {
      table.add({"  truth", "", "", step.truth.label, "", "", "", "", "", "wrong object"});
    }
  }
  return decisions(records, task) + table.text() + findings(records, task) +
         symmetries(records, task) + summary(records) + confusions(records, task);
}

}  // namespace palpate::cli
