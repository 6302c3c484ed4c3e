#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <nanobind/stl/array.h>
#include <nanobind/stl/optional.h>
#include <nanobind/stl/pair.h>
#include <nanobind/stl/string_view.h>
#include <nanobind/stl/vector.h>

#include "arrays.hpp"
#include "bindings.hpp"
#include "call.hpp"
#include "recognition/judged_results.hpp"
#include "types.hpp"

namespace palpate::python {

using namespace nb::literals;

namespace {

struct JudgedEvaluation : Evaluation {
  std::size_t without_truth = 0;
  std::size_t failed = 0;
};

JudgedEvaluation evaluate_results(const std::vector<std::string>& paths, const nb::bytes& records) {
  const std::string text(records.c_str(), records.size());
  return run([=](Call&) {
    JudgedResults results = read_results(result_files(paths));
    add_records("records", text, results);
    return JudgedEvaluation{evaluate(results, paths.empty() ? "records" : paths.front()),
                            results.without_truth, results.failed};
  });
}

std::pair<double, double> pair_of(const Interval& interval) {
  return {interval.low, interval.high};
}

std::optional<std::pair<double, std::size_t>> pair_of(const std::optional<Median>& median) {
  return median ? std::optional(std::pair(median->value, median->count)) : std::nullopt;
}

/// [class, answer]
Result<std::uint64_t, 2> confusion_of(const Evaluation& evaluation) {
  std::vector<std::uint64_t> counts;
  for (const ClassScores& scores : evaluation.classes) {
    counts.insert(counts.end(), scores.taken.begin(), scores.taken.end());
  }
  return owned(std::move(counts), {evaluation.classes.size(), evaluation.answers.size()});
}

void bind_scores(nb::module_& module) {
  nb::class_<ReliabilityBin>(module, "ReliabilityBin",
                             "The records whose best label has a probability in [lower, upper).")
      .def_ro("lower", &ReliabilityBin::lower, "Least confidence.")
      .def_ro("upper", &ReliabilityBin::upper, "Largest confidence; the last bin includes 1.")
      .def_ro("records", &ReliabilityBin::records, "How many records.")
      .def_ro("right", &ReliabilityBin::right, "How many are right.")
      .def_ro("mean_confidence", &ReliabilityBin::mean_confidence, "0 where there are no records.")
      .def_prop_ro("accuracy", &ReliabilityBin::accuracy, "NaN where there are no records.")
      .def_prop_ro(
          "accuracy_interval", [](const ReliabilityBin& self) { return pair_of(self.interval()); },
          "95 % interval (low, high) of the accuracy (Wilson).");

  nb::class_<Scores>(module, "Scores", "How right, and how honest, a set of records is.")
      .def_ro("records", &Scores::records, "How many records.")
      .def_ro("right", &Scores::right, "How many are right.")
      .def_prop_ro("accuracy", &Scores::accuracy, "right / records.")
      .def_prop_ro(
          "accuracy_interval", [](const Scores& self) { return pair_of(self.interval()); },
          "95 % interval (low, high) of the accuracy (Wilson).")
      .def_ro("log_loss", &Scores::log_loss,
              "Mean of -log of the right answer's probability, nats; no probability counts below\n"
              "1e-12.")
      .def_ro("calibration_error", &Scores::calibration_error,
              "Mean over the records of how far the accuracy of their bin is from its mean\n"
              "confidence (expected calibration error).")
      .def_ro("reliability", &Scores::bins, "Ten equal bins of confidence.")
      .def("plot", plot_method, "ax"_a = nb::none(), plot_signature,
           "Draws accuracy over confidence with Matplotlib. Returns the axes.")
      .def("__repr__", [](const Scores& self) {
        return fmt::format("Scores({} of {} right, log_loss {:.3f} nats)", self.right, self.records,
                           self.log_loss);
      });

  nb::class_<ClassScores>(module, "ClassScores", "The records of one true label.")
      .def_ro("label", &ClassScores::label, "The true label.")
      .def_ro("known", &ClassScores::known, "Whether the records' maps had the label.")
      .def_ro("records", &ClassScores::records, "How many records.")
      .def_ro("right", &ClassScores::right,
              "How many are right; of an unknown class: called \"(none)\".")
      .def_prop_ro("recall", &ClassScores::recall, "right / records.")
      .def_prop_ro(
          "recall_interval", [](const ClassScores& self) { return pair_of(self.interval()); },
          "95 % interval (low, high) of the recall (Wilson).");

  nb::class_<KnownAgainstUnknown>(
      module, "KnownAgainstUnknown",
      "How well a score tells records of known classes from those of unknown ones.")
      .def_prop_ro(
          "score", [](const KnownAgainstUnknown& self) { return name_of(self.score); },
          "\"1 - none\" or \"fit.z\": the field that most records have.")
      .def_ro("known", &KnownAgainstUnknown::known, "Records of known classes with the score.")
      .def_ro("unknown", &KnownAgainstUnknown::unknown, "Records of unknown classes with it.")
      .def_ro(
          "area", &KnownAgainstUnknown::area,
          "Probability that the record of the known class has the larger score: the area under\n"
          "the curve (ROC).")
      .def_ro("standard_error", &KnownAgainstUnknown::standard_error, "Of the area.");
}

}  // namespace

void bind_evaluation(nb::module_& module) {
  bind_scores(module);
  nb::class_<JudgedEvaluation>(
      module, "Evaluation",
      "Records compared with the truth. A class that no map has is unknown; its right answer is\n"
      "\"(none)\".")
      .def_ro("all", &JudgedEvaluation::all, "Of all records.")
      .def_ro("known", &JudgedEvaluation::known,
              "Of known classes alone, where others are among the records; else None.")
      .def_ro("unknown", &JudgedEvaluation::unknown,
              "Of unknown classes, where `right` counts those called \"(none)\"; or None.")
      .def_ro("known_against_unknown", &JudgedEvaluation::known_against_unknown,
              "Where records of both kinds have a score to tell them by; else None.")
      .def_ro("classes", &JudgedEvaluation::classes, "By true label, known ones first.")
      .def_ro(
          "answers", &JudgedEvaluation::answers,
          "Labels of known classes, and what else was some record's best; last \"(none)\", where\n"
          "it was possible.")
      .def_prop_ro(
          "confusion", [](const JudgedEvaluation& self) { return confusion_of(self); },
          "[class, answer] how often records of a class were taken for an answer.")
      .def_prop_ro(
          "error_mm", [](const JudgedEvaluation& self) { return pair_of(self.error_mm); },
          "(median pose error of the modes, mm, number of records that have one), or None.")
      .def_prop_ro(
          "refined_error_mm",
          [](const JudgedEvaluation& self) { return pair_of(self.refined_error_mm); },
          "The same of the refined poses.")
      .def_ro("without_truth", &JudgedEvaluation::without_truth,
              "Records without a true label, which were left out.")
      .def("plot", plot_method, "ax"_a = nb::none(), plot_signature,
           "Draws which classes are taken for which with Matplotlib. Returns the axes.")
      .def_ro("failed", &JudgedEvaluation::failed, "Records with an error, which were left out.")
      .def("__repr__", [](const JudgedEvaluation& self) {
        return fmt::format("Evaluation({} of {} right, {} classes)", self.all.right,
                           self.all.records, self.classes.size());
      });
  module.def("evaluate_results", &evaluate_results, "paths"_a, "records"_a,
             "Files and folders of results, and more records as a JSON array.");
}

}  // namespace palpate::python
