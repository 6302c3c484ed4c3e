#include "cli/batch/batch_run.hpp"

#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <climits>
#include <condition_variable>
#include <deque>
#include <exception>
#include <map>
#include <mutex>
#include <optional>
#include <thread>
#include <utility>

#include "cli/options.hpp"
#include "cli/step_words.hpp"
#include "io/input_file.hpp"
#include "recognition/batch/input_reading.hpp"
#include "recognition/record_json.hpp"

namespace palpate::cli {

namespace {

using namespace std::chrono_literals;

/// Most bytes of unknowns that have been read and wait to be recognised; a single one may be
/// larger.
constexpr std::size_t most_waiting_bytes = 64 << 20;
/// How often progress is shown where nothing else happens.
constexpr auto pause = 200ms;

/// An unknown that has been read. `recording` keeps its touches alive.
struct Job {
  std::size_t index;  ///< among all unknowns
  std::shared_ptr<const Recording> recording;
  Query unknown;
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
  constexpr std::int64_t filling_bins = 4'000'000;
  constexpr std::int64_t limit = 16;
  const auto together = std::clamp<std::int64_t>(filling_bins / task.bins_in_all(), 1, limit);
  return std::min(threads, static_cast<std::size_t>(together));
}

std::string host_name() {
  char name[HOST_NAME_MAX + 1] = {};
  return ::gethostname(name, sizeof name - 1) == 0 ? name : "";
}

std::size_t bytes_of(const Query& unknown) {
  constexpr std::size_t least = 4096;
  std::size_t bytes = least;
  for (const Touch& touch : unknown.touches) {
    bytes += sizeof(Touch) + touch.pressure.size() * (sizeof(double) + sizeof(glm::dvec2));
  }
  return bytes;
}

/// Threads that read unknowns, and threads that recognise them and write the chunks.
class Pipeline {
 public:
  explicit Pipeline(const BatchRun& run)
      : run_(run), task_(run.job.task()), unknowns_(run.task.unknowns()) {
    std::size_t at = 0;
    for (const BatchEntry& entry : run.task.inputs) {
      first_.push_back(at);
      at += run.task.unknowns_of(entry);
    }
    recognisers_ = std::min(most_at_once(task_, run.threads), run.to_be_done);
  }

  BatchCounts run(const std::function<void(const BatchCounts&)>& progress) {
    recognisers_left_ = recognisers_;
    readers_left_ = (recognisers_ + 1) / 2;
    std::vector<std::jthread> threads;
    try {
      for (std::size_t i = (recognisers_ + 1) / 2; i > 0; --i) {
        threads.emplace_back([this] { guard([this] { read(); }, readers_left_); });
      }
      for (std::size_t i = 0; i < recognisers_; ++i) {
        threads.emplace_back(
            [this, i] { guard([this, i] { recognise_unknowns(i == 0); }, recognisers_left_); });
      }
      tell_until_end(progress);
    } catch (...) {
      fail(std::current_exception());
    }
    threads.clear();  // joins
    if (failure_) {
      std::rethrow_exception(failure_);
    }
    return counts_;
  }

 private:
  std::size_t chunk_of(std::size_t unknown) const { return unknown / run_.task.chunk_unknowns; }

  /// Without the mutex: the threads go on where whoever reads the progress does not.
  void tell_until_end(const std::function<void(const BatchCounts&)>& progress) {
    for (bool ended = false; !ended;) {
      std::unique_lock lock(mutex_);
      ended = ended_.wait_for(lock, pause, [this] { return recognisers_left_ == 0; });
      const BatchCounts counts = counts_;
      lock.unlock();
      progress(counts);
    }
  }

  /// The first failure ends all threads.
  void fail(const std::exception_ptr& failure) {
    const std::lock_guard lock(mutex_);
    failure_ = failure_ ? failure_ : failure;
    room_.notify_all();
    arrived_.notify_all();
  }

  /// Runs one of `left` threads.
  template <typename Work>
  void guard(const Work& work, std::size_t& left) {
    try {
      work();
    } catch (...) {
      fail(std::current_exception());
    }
    const std::lock_guard lock(mutex_);
    if (--left == 0) {
      arrived_.notify_all();
      ended_.notify_one();
    }
  }

  bool is_wanted(std::size_t input) const {
    const std::size_t first = first_[input];
    const std::size_t count = run_.task.unknowns_of(run_.task.inputs[input]);
    for (std::size_t chunk = chunk_of(first); count > 0 && chunk <= chunk_of(first + count - 1);
         ++chunk) {
      if (run_.wanted[chunk]) {
        return true;
      }
    }
    return false;
  }

  void read() {
    for (std::size_t i = next_input_++; i < first_.size(); i = next_input_++) {
      if (is_wanted(i) &&
          !push_unknowns(i, read_entry(run_.task, run_.task.inputs[i], run_.job.request()))) {
        return;
      }
    }
  }

  /// False where another thread has failed.
  bool push_unknowns(std::size_t input, ReadInput read) {
    for (std::size_t i = 0; i < read.unknowns.size(); ++i) {
      const std::size_t index = first_[input] + i;
      if (run_.wanted[chunk_of(index)] &&
          !push({index, read.recording, std::move(read.unknowns[i])})) {
        return false;
      }
    }
    return true;
  }

  /// Waits for room. False where another thread has failed.
  bool push(Job job) {
    const std::size_t bytes = bytes_of(job.unknown);
    std::unique_lock lock(mutex_);
    room_.wait(lock, [&] {
      return failure_ || waiting_.empty() || waiting_bytes_ + bytes <= most_waiting_bytes;
    });
    if (failure_) {
      return false;
    }
    waiting_bytes_ += bytes;
    waiting_.push_back(std::move(job));
    arrived_.notify_one();
    return true;
  }

  /// Waits for an unknown; none where all have been taken or another thread has failed.
  std::optional<Job> pop() {
    std::unique_lock lock(mutex_);
    arrived_.wait(lock, [&] { return failure_ || !waiting_.empty() || readers_left_ == 0; });
    if (failure_ || waiting_.empty()) {
      return {};
    }
    std::optional<Job> job(std::move(waiting_.front()));
    waiting_.pop_front();
    waiting_bytes_ -= bytes_of(job->unknown);
    room_.notify_one();
    return job;
  }

  void recognise_unknowns(bool first) {
    const bool trace = run_.job.request().trace;
    Recogniser recogniser = run_.job.open({.threads = run_.threads / recognisers_});
    if (first && run_.verbose) {
      print_engine(run_.job, recogniser);
    }
    while (const std::optional<Job> job = pop()) {
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
  std::vector<std::size_t> first_;  ///< [input] index of its first unknown
  std::size_t recognisers_ = 1;
  std::atomic<std::size_t> next_input_ = 0;
  std::atomic<bool> told_ = false;

  std::mutex mutex_;                 ///< of what follows
  std::condition_variable room_;     ///< for one more unknown; readers wait for it
  std::condition_variable arrived_;  ///< an unknown, or the last one; recognisers wait for it
  std::condition_variable ended_;    ///< all recognisers
  std::deque<Job> waiting_;
  std::size_t waiting_bytes_ = 0;
  std::size_t readers_left_ = 0;
  std::size_t recognisers_left_ = 0;
  std::exception_ptr failure_;  ///< the first one
  std::map<std::size_t, OpenChunk> open_;
  BatchCounts counts_;
};

}  // namespace

BatchCounts run_batch(const BatchRun& run,
                      const std::function<void(const BatchCounts&)>& progress) {
  return Pipeline(run).run(progress);
}

}  // namespace palpate::cli
