#include "cli/batch/batch_run.hpp"

#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <climits>
#include <future>
#include <map>
#include <mutex>
#include <optional>
#include <utility>

#include "cli/options.hpp"
#include "cli/step_words.hpp"
#include "estimation/bounded/search_memory.hpp"
#include "io/input_file.hpp"
#include "recognition/batch/input_reading.hpp"
#include "recognition/record_json.hpp"

namespace palpate::cli {

namespace {

using namespace std::chrono_literals;

/// How often progress is shown where nothing else happens.
constexpr auto pause = 200ms;

/// An unknown that has been read. `recording` keeps its touches alive.
struct Job {
  std::size_t index;  ///< among all unknowns
  std::shared_ptr<const Recording> recording;
  Query unknown;
};

/// An input that has wanted unknowns.
struct WantedInput {
  std::size_t first = 0;  ///< index of its first unknown among all
  const BatchEntry* entry = nullptr;
};

/// An input that has been read.
struct NumberedInput {
  std::size_t first = 0;  ///< index of its first unknown among all
  ReadInput input = {};
};

/// The lines of a chunk, some of which are still missing.
struct OpenChunk {
  std::vector<std::string> lines;
  std::vector<double> seconds;
  std::size_t missing = 0;
  std::size_t failed = 0;
};

/// How many unknowns are recognised at once.
std::size_t most_at_once(const RecognitionTask& task, std::size_t threads) {
  const FilterTraits traits = traits_of(task.filter);
  if (traits.certificate) {
    return threads;
  }
  if (!traits.every_bin) {
    return 1;
  }
  // A device that has few bins waits for the host, unless another thread gives it work meanwhile.
  constexpr double filling_bins = 4e6;
  constexpr double limit = 16.0;
  const double bins = bins_in_all(task.hypotheses.size(), task.lattice());
  return std::min(threads, static_cast<std::size_t>(std::clamp(filling_bins / bins, 1.0, limit)));
}

std::string host_name() {
  char name[HOST_NAME_MAX + 1] = {};
  return ::gethostname(name, sizeof name - 1) == 0 ? name : "";
}

/// Threads that take unknowns, recognise them and write the chunks, and one that reads ahead.
class Pipeline {
 public:
  explicit Pipeline(const BatchRun& run)
      : run_(run), task_(run.job.task()), unknowns_(run.task.unknowns()) {
    std::size_t first = 0;
    for (const BatchEntry& entry : run.task.inputs) {
      const std::size_t end = first + run.task.unknowns_of(entry);
      bool wanted = false;
      for (std::size_t unknown = first; unknown < end; ++unknown) {
        wanted = wanted || run.wanted[chunk_of(unknown)];
      }
      if (wanted) {
        inputs_.push_back({first, &entry});
      }
      first = end;
    }
    recognisers_ = std::min(most_at_once(task_, run.threads), run.to_be_done);
  }

  BatchCounts run(const std::function<void(const BatchCounts&)>& progress) {
    read_ahead();
    std::vector<std::future<void>> recognisers;  // whose end joins the threads
    stopping_all_on_failure([&] {
      for (std::size_t i = 0; i < recognisers_; ++i) {
        recognisers.push_back(std::async(std::launch::async, [this, i] {
          stopping_all_on_failure([&] { recognise_unknowns(i == 0); });
        }));
      }
      for (std::future<void>& recogniser : recognisers) {
        while (recogniser.wait_for(pause) != std::future_status::ready) {
          progress(counts());
        }
        recogniser.get();
      }
      progress(counts());
    });
    return counts_;
  }

 private:
  std::size_t chunk_of(std::size_t unknown) const { return unknown / run_.task.chunk_unknowns; }

  template <typename Work>
  void stopping_all_on_failure(const Work& work) {
    try {
      work();
    } catch (...) {
      stop_ = true;
      throw;
    }
  }

  /// Copied: the threads go on where whoever reads the progress does not.
  BatchCounts counts() {
    const std::lock_guard lock(mutex_);
    return counts_;
  }

  /// Begins to read the next input. libhdf5 reads one file at a time.
  void read_ahead() {
    if (next_input_ < inputs_.size()) {
      ahead_ = std::async(std::launch::async, [this, next = inputs_[next_input_++]] {
        return NumberedInput{next.first, read_entry(run_.task, *next.entry, run_.job.request())};
      });
    }
  }

  /// The next unknown that is wanted; none where all are taken or another thread has failed.
  std::optional<Job> next() {
    const std::lock_guard reading(reading_mutex_);
    while (!stop_) {
      std::vector<Query>& unknowns = present_.input.unknowns;
      for (; taken_ < unknowns.size(); ++taken_) {
        if (const std::size_t index = present_.first + taken_; run_.wanted[chunk_of(index)]) {
          return Job{index, present_.input.recording, std::move(unknowns[taken_++])};
        }
      }
      if (!ahead_.valid()) {
        break;
      }
      present_ = ahead_.get();
      taken_ = 0;
      read_ahead();
    }
    return {};
  }

  void recognise_unknowns(bool first) {
    const bool trace = run_.job.request().trace;
    Recogniser recogniser = run_.job.open({.threads = run_.threads / recognisers_});
    if (first && run_.verbose) {
      print_engine(run_.job, recogniser);
    }
    while (const std::optional<Job> job = next()) {
      const RecognitionRecord record = recognise(recogniser, task_, job->unknown, trace);
      if (record.error.empty()) {
        tell_once(recogniser.unresolved_words());
      }
      add(job->index, record, text_of(to_json(record, task_, std::nullopt, trace)));
    }
  }

  void tell_once(const std::string& sentence) {
    if (!sentence.empty() && !told_.exchange(true)) {
      tell_on_stderr(sentence);
    }
  }

  /// Takes the line of a record, and writes its chunk where that was the last one missing.
  void add(std::size_t unknown, const RecognitionRecord& record, std::string line) {
    const std::size_t index = chunk_of(unknown);
    const std::size_t first = index * run_.task.chunk_unknowns;
    const bool failed = !record.error.empty();
    OpenChunk finished;
    {
      const std::lock_guard lock(mutex_);
      OpenChunk& chunk = open_[index];
      if (chunk.lines.empty()) {
        chunk.missing = std::min(run_.task.chunk_unknowns, unknowns_ - first);
        chunk.lines.resize(chunk.missing);
        chunk.seconds.resize(chunk.missing);
      }
      chunk.lines[unknown - first] = std::move(line);
      chunk.seconds[unknown - first] = record.seconds;
      chunk.failed += failed ? 1 : 0;
      counts_.failed += failed ? 1 : 0;
      ++counts_.done;
      if (--chunk.missing > 0) {
        return;
      }
      finished = std::move(chunk);
      open_.erase(index);
    }
    write(index, finished);
  }

  void write(std::size_t index, const OpenChunk& chunk) const {
    // First: a chunk that is there has its run.
    write_file(run_.folder.run(index),
               text_of({{"first", index * run_.task.chunk_unknowns},
                        {"unknowns", chunk.lines.size()},
                        {"failed", chunk.failed},
                        {"host", host_name()},
                        {"device", run_.job.device_name()},
                        {"seconds", chunk.seconds}}),
               AtomicFile::Links::replaced);
    std::string text;
    for (const std::string& line : chunk.lines) {
      text += line;
    }
    write_file(run_.folder.chunk(index), text, AtomicFile::Links::replaced);
  }

  const BatchRun& run_;
  const RecognitionTask& task_;
  const std::size_t unknowns_;
  std::vector<WantedInput> inputs_;
  std::size_t recognisers_ = 1;
  std::atomic<bool> told_ = false;
  std::atomic<bool> stop_ = false;  ///< as something has failed

  std::mutex reading_mutex_;  ///< of what follows
  std::size_t next_input_ = 0;
  std::future<NumberedInput> ahead_;  ///< the input after this one; invalid after the last
  NumberedInput present_;
  std::size_t taken_ = 0;  ///< of its unknowns

  std::mutex mutex_;  ///< of what follows
  std::map<std::size_t, OpenChunk> open_;
  BatchCounts counts_;
};

}  // namespace

BatchCounts run_batch(const BatchRun& run,
                      const std::function<void(const BatchCounts&)>& progress) {
  return Pipeline(run).run(progress);
}

}  // namespace palpate::cli
