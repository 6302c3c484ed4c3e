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
#include "cli/recognition_flags.hpp"
#include "cli/step_words.hpp"
#include "io/input_file.hpp"
#include "recognition/batch/batch_task.hpp"
#include "recognition/record_json.hpp"

namespace palpate::cli {

namespace {

/// A queue between threads that holds no more than so many bytes, or one item that is larger.
template <typename Item>
class BoundedQueue {
 public:
  explicit BoundedQueue(std::size_t most_bytes) : most_bytes_(most_bytes) {}

  /// Waits for room. False where the queue is closed, which drops the item.
  bool push(Item item, std::size_t bytes) {
    std::unique_lock lock(mutex_);
    room_.wait(lock, [&] { return closed_ || items_.empty() || bytes_ + bytes <= most_bytes_; });
    if (closed_) {
      return false;
    }
    bytes_ += bytes;
    items_.emplace_back(std::move(item), bytes);
    item_.notify_one();
    return true;
  }

  /// Waits for an item. None once the queue is closed and empty.
  std::optional<Item> pop() {
    std::unique_lock lock(mutex_);
    item_.wait(lock, [&] { return closed_ || !items_.empty(); });
    return take();
  }

  /// As pop(), but returns none where no item comes within this time.
  std::optional<Item> pop_within(std::chrono::milliseconds time) {
    std::unique_lock lock(mutex_);
    item_.wait_for(lock, time, [&] { return closed_ || !items_.empty(); });
    return take();
  }

  /// Lets nothing more in. What is in the queue still comes out.
  void close() {
    const std::lock_guard lock(mutex_);
    closed_ = true;
    item_.notify_all();
    room_.notify_all();
  }
  bool ended() {
    const std::lock_guard lock(mutex_);
    return closed_ && items_.empty();
  }

 private:
  std::optional<Item> take() {
    if (items_.empty()) {
      return {};
    }
    std::optional<Item> item(std::move(items_.front().first));
    bytes_ -= items_.front().second;
    items_.pop_front();
    room_.notify_all();
    return item;
  }

  std::size_t most_bytes_;
  std::mutex mutex_;
  std::condition_variable item_;
  std::condition_variable room_;
  std::deque<std::pair<Item, std::size_t>> items_;
  std::size_t bytes_ = 0;
  bool closed_ = false;
};

using namespace std::chrono_literals;

/// Unknowns that have been read, and lines that wait for the disk.
constexpr std::size_t most_waiting_bytes = 64 << 20;
/// How often progress is shown where nothing else happens.
constexpr auto pause = 200ms;

/// An unknown that has been read. `recording` keeps its touches alive.
struct Job {
  std::size_t index;  ///< among all unknowns
  std::shared_ptr<const Recording> recording;
  Query unknown;
};

/// A record as text.
struct RecordLine {
  std::size_t index;
  std::string text;
  double seconds;
  bool failed;
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
  constexpr std::int64_t most = 16;
  const auto together = std::clamp<std::int64_t>(filling_bins / task.bins_in_all(), 1, most);
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

class Pipeline {
 public:
  explicit Pipeline(const BatchRun& run)
      : run_(run),
        task_(run.job.task()),
        unknowns_(run.task.unknowns()),
        jobs_(most_waiting_bytes),
        lines_(most_waiting_bytes) {
    std::size_t at = 0;
    for (const BatchEntry& entry : run.task.inputs) {
      first_.push_back(at);
      at += run.task.unknowns_of(entry);
    }
    recognisers_ = std::min(most_at_once(task_, run.threads), run.to_be_done);
  }

  BatchCounts run(const std::function<void(const BatchCounts&)>& progress) {
    readers_left_ = (recognisers_ + 1) / 2;
    recognisers_left_ = recognisers_;
    std::vector<std::jthread> threads;
    for (std::size_t i = 0; i < (recognisers_ + 1) / 2; ++i) {
      threads.emplace_back([&] { guard([&] { read(); }, readers_left_, jobs_); });
    }
    for (std::size_t i = 0; i < recognisers_; ++i) {
      threads.emplace_back(
          [this, i] { guard([this, i] { recognise_jobs(i == 0); }, recognisers_left_, lines_); });
    }
    try {
      write(progress);
    } catch (...) {
      fail();
    }
    threads.clear();  // joins
    if (failure_) {
      std::rethrow_exception(failure_);
    }
    return counts_;
  }

 private:
  std::size_t chunk_of(std::size_t unknown) const { return unknown / run_.task.chunk_unknowns; }

  /// Remembers the exception at hand, if it is the first one, and ends all threads.
  void fail() {
    {
      const std::lock_guard lock(mutex_);
      failure_ = failure_ ? failure_ : std::current_exception();
    }
    jobs_.close();
    lines_.close();
  }

  /// Runs a thread; the last one of its kind closes the queue that they fill.
  template <typename Work, typename Queue>
  void guard(const Work& work, std::atomic<std::size_t>& left, Queue& filled) {
    try {
      work();
    } catch (...) {
      fail();
    }
    if (--left == 0) {
      filled.close();
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

  /// False where the queue is closed.
  bool push_unknowns(std::size_t input, ReadInput read) {
    for (std::size_t i = 0; i < read.unknowns.size(); ++i) {
      const std::size_t index = first_[input] + i;
      if (run_.wanted[chunk_of(index)]) {
        const std::size_t bytes = bytes_of(read.unknowns[i]);
        if (!jobs_.push({index, read.recording, std::move(read.unknowns[i])}, bytes)) {
          return false;
        }
      }
    }
    return true;
  }

  void recognise_jobs(bool first) {
    const bool trace = run_.job.request().trace;
    Recogniser recogniser = run_.job.open({.threads = run_.threads / recognisers_});
    if (first && run_.verbose) {
      print_engine(run_.job, recogniser);
    }
    while (const std::optional<Job> job = jobs_.pop()) {
      const RecognitionRecord record = recognise(recogniser, task_, job->unknown, trace);
      if (record.error.empty()) {
        tell_once(recogniser.unresolved_words());
      }
      RecordLine line{job->index, text_of(to_json(record, task_, std::nullopt, trace)),
                      record.seconds, !record.error.empty()};
      const std::size_t bytes = line.text.size();
      if (!lines_.push(std::move(line), bytes)) {
        return;
      }
    }
  }

  void tell_once(const std::string& sentence) {
    if (!sentence.empty() && !told_.exchange(true)) {
      tell_on_stderr(sentence);
    }
  }

  void write(const std::function<void(const BatchCounts&)>& progress) {
    while (!lines_.ended()) {
      if (std::optional<RecordLine> line = lines_.pop_within(pause)) {
        add(*std::move(line));
      }
      progress(counts_);
    }
  }

  void add(RecordLine line) {
    const std::size_t chunk = chunk_of(line.index);
    const std::size_t first = chunk * run_.task.chunk_unknowns;
    OpenChunk& open = open_[chunk];
    if (open.lines.empty()) {
      open.missing = std::min(run_.task.chunk_unknowns, unknowns_ - first);
      open.lines.resize(open.missing);
      open.seconds.resize(open.missing);
    }
    open.lines[line.index - first] = std::move(line.text);
    open.seconds[line.index - first] = line.seconds;
    open.failed += line.failed ? 1 : 0;
    counts_.failed += line.failed ? 1 : 0;
    ++counts_.done;
    if (--open.missing == 0) {
      write(chunk, open);
      open_.erase(chunk);
    }
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
  std::size_t unknowns_;
  std::vector<std::size_t> first_;  ///< [input] index of its first unknown
  std::size_t recognisers_ = 1;
  BoundedQueue<Job> jobs_;
  BoundedQueue<RecordLine> lines_;
  std::atomic<std::size_t> next_input_ = 0;
  std::atomic<std::size_t> readers_left_ = 0;
  std::atomic<std::size_t> recognisers_left_ = 0;
  std::atomic<bool> told_ = false;
  std::mutex mutex_;
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
