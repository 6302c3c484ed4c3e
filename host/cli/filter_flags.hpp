#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>

#include "palpate/scene.hpp"
#include "recognition/recogniser.hpp"

namespace CLI {
class App;
}

namespace palpate::cli {

struct RecognitionFlags;

/// The flags that choose a filter and set it up, as given.
struct FilterFlags {
  std::string filter;
  std::optional<double> tolerance;
  std::optional<double> budget_ms;
  std::optional<double> evidence_nats;
  std::optional<int> particles;
  std::string resampling;
  bool augmented = false;
  std::optional<std::uint64_t> seed;
  std::optional<int> memory_mib;
};

void add_filter_flags(CLI::App& command, FilterFlags& flags);

/// Leaves the flags of other filters than the histogram out of the help of a command that needs the
/// histogram. They are read still, so that the command refuses them with its reason.
void hide_other_filters(CLI::App& command);

/// Why a command needs the histogram, beside what flags and scene say of the task.
struct HistogramNeed {
  std::string flag = {};  ///< that asks for what needs it; "" where the command always does
  std::string why = {};   ///< "" where every filter will do
};

/// The filter that the flags or the scene name; a flag overrides the scene's key.
struct FilterWish {
  enum class Kind { automatic, histogram, bounded, particles };
  Kind kind = Kind::automatic;
  /// What names it, such as "--filter bounded", "filter: bounded in a.yaml" or "--tolerance";
  /// "--filter auto" where nothing does.
  std::string by;
};

/// Throws Error on a filter that does not exist, and on flags that only another filter reads.
FilterWish filter_wish(const RecognitionFlags& flags, const Scene& scene);

struct ChosenFilter {
  FilterOptions options;
  bool automatic = false;         ///< RecognitionTask::auto_filter
  std::string asked_for_by = {};  ///< RecognitionTask::filter_asked_for_by
};

/// The options of the filter that is wished for. Leaves the choice between histogram and bounds to
/// settle_filter() where neither is wished for and nothing needs the histogram. Throws Error on
/// values out of range, and where bounds are wished for beside a flag or key that needs the
/// histogram.
/// @param histogram what flags and scene say of lattice and contact
ChosenFilter choose_filter(const FilterWish& wish, const RecognitionFlags& flags,
                           const Scene& scene, const HistogramNeed& need,
                           std::span<const Hypothesis> hypotheses, HistogramOptions histogram);

/// Makes the filter. Where the device has no memory for the histogram's bins, the Error names the
/// flags without which bounds would take them.
Recogniser open_filter(Device& device, const RecognitionTask& task);

}  // namespace palpate::cli
