#include "palpate/frame_recorder.hpp"

#include <fmt/format.h>
#include <sys/file.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <exception>
#include <limits>
#include <map>
#include <string>
#include <string_view>
#include <utility>

#include "io/file_format.hpp"
#include "io/hdf5_writer.hpp"
#include "io/input_file.hpp"
#include "io/recording_rules.hpp"
#include "model/log_message.hpp"
#include "model/printable.hpp"
#include "model/stream_time.hpp"
#include "palpate/error.hpp"

namespace palpate {

namespace {

using Clock = std::chrono::steady_clock;

// A quarter of the second that may be lost, to leave time for a pause of the machine.
constexpr double flush_interval_s = 0.25;
// Bounds the memory of frames replayed at full speed between two flushes.
constexpr std::size_t most_pending_values = 1 << 20;

constexpr double unknown = std::numeric_limits<double>::quiet_NaN();

// Rows that wait to be saved.
struct Rows {
  std::vector<float> pressure;  // [n, e]
  std::vector<Pose> sensor_pose;
  std::vector<double> device_time_s;  // [n]
  std::vector<std::uint64_t> lost_before;
  std::vector<double> time_s;

  std::size_t size() const { return time_s.size(); }
};

// Returns the recording without its rows.
Recording head_of(const SensorDescription& sensor) {
  Recording head;
  head.rows = "frames";
  head.object = sensor.object;
  head.pressure_unit = sensor.pressure_unit;
  head.elements_mm = sensor.elements_mm;
  head.valid = sensor.valid;
  head.baseline = sensor.baseline;
  head.truth = sensor.truth;
  head.findings = sensor.findings;
  // A board may send any bytes; readers refuse those that are not printable.
  head.sensor = printable(sensor.name);
  head.serial = printable(sensor.serial);
  return head;
}

}  // namespace

struct FrameRecorder::Impl {
  Impl(std::filesystem::path file_path, SensorDescription description)
      : path(std::move(file_path)), sensor(std::move(description)) {}

  bool alive(std::size_t element) const { return sensor.valid.empty() || sensor.valid[element]; }

  void require_recordable() const {
    const std::size_t e = sensor.elements_mm.size();
    const auto fits = [&](const auto& list) { return list.empty() || list.size() == e; };
    if (e == 0 || !fits(sensor.valid) || !fits(sensor.baseline)) {
      refuse(path, "sensor '{}' has {} elements, {} valid and {} baseline values; make them agree",
             printable(sensor.name), e, sensor.valid.size(), sensor.baseline.size());
    }
    require_head(path, head_of(sensor), e);
    require_elements(path, 0, sensor.elements_mm);
  }

  bool due() const {
    return pending.pressure.size() >= most_pending_values ||
           // The stream's own time counts, too: a late reader catches up faster than the clock
           // runs.
           std::abs(pending.time_s.back() - pending.time_s.front()) >= flush_interval_s ||
           std::chrono::duration<double>(Clock::now() - oldest_pending).count() >= flush_interval_s;
  }

  void save() {
    if (pending.size() == 0) {
      return;
    }
    const std::size_t rows = pending.size();
    if (saved == 0) {
      create();
    } else {
      append();
      saved += rows;
    }
    pending = {};
  }

  // Calls use(name, shape of a row, values) of every dataset that grows. `time` comes last: a row
  // that has its time is complete.
  void each_dataset(const auto& use) {
    using Shape = Hdf5Writer::Shape;
    use("pressure", Shape{sensor.elements_mm.size()}, pending.pressure);
    use("sensor_pose", Shape{3}, pending.sensor_pose);
    if (has_device_time) {
      use("device_time", Shape{}, pending.device_time_s);
    }
    use("lost_before", Shape{}, pending.lost_before);
    use("time", Shape{}, pending.time_s);
  }

  // Writes the first rows as a whole file, opens it for more, and then gives it its name: whenever
  // the recorder is killed, there is no file or a readable one, and a reader can always tell that
  // the file is being recorded.
  void create() {
    const std::size_t n = pending.size();
    const std::size_t e = sensor.elements_mm.size();
    has_device_time = std::isfinite(pending.device_time_s.front());
    {
      Hdf5Writer out(path, Hdf5Writer::Layout::appendable);
      write_head(out, head_of(sensor));
      out.dataset("elements", {e, 2}, sensor.elements_mm);
      if (!sensor.valid.empty()) {
        out.dataset("valid", {e}, sensor.valid);
      }
      if (!sensor.baseline.empty()) {
        out.dataset("baseline", {e}, sensor.baseline);
      }
      each_dataset([&](const char* name, Hdf5Writer::Shape shape, const auto& values) {
        shape.insert(shape.begin(), n);
        out.dataset(name, shape, values, Hdf5Writer::Storage::growing);
      });
      try {
        out.save([&](const std::filesystem::path& finished) { open(finished); });
      } catch (...) {
        // The file never appears.
        if (file.valid()) {
          give_up_hdf5_file(file.get());
        }
        close();
        throw;
      }
    }
    saved = n;
  }

  void open(const std::filesystem::path& finished) {
    const Hdf5Handle access(H5Pcreate(H5P_FILE_ACCESS), H5Pclose);
    set_appendable(access.get());
    H5Pset_file_locking(access.get(), true, true);  // some network file systems have no locks
    file = {H5Fopen(finished.c_str(), H5F_ACC_RDWR | H5F_ACC_SWMR_WRITE, access.get()), H5Fclose};
    // HDF5 locks a file with SWMR only while it opens it. This lock, which recorder_of() looks for,
    // lasts while the file is open; a file system without locks refuses it.
    if (void* descriptor = nullptr; H5Fget_vfd_handle(file.get(), H5P_DEFAULT, &descriptor) >= 0) {
      ::flock(*static_cast<int*>(descriptor), LOCK_SH | LOCK_NB);
    }
    bool open = file.valid();
    each_dataset([&](const char* name, const Hdf5Writer::Shape&, const auto&) {
      Hdf5Handle dataset(H5Dopen2(file.get(), name, H5P_DEFAULT), H5Dclose);
      open = open && dataset.valid();
      datasets.emplace(name, std::move(dataset));
    });
    if (!open) {
      throw Error(Fault::system,
                  fmt::format("{}: cannot be written: {}; free or repair the disk and try again",
                              path.string(), hdf5_failure()));
    }
  }

  void append() {
    if (!file.valid()) {
      throw Error(Fault::system,
                  fmt::format("{}: is closed; record to another file", path.string()));
    }
    const Hdf5Session session;
    each_dataset([this](const char* name, const Hdf5Writer::Shape& row, const auto& values) {
      append(datasets.at(name).get(), row.empty() ? 1 : row[0], values.data());
    });
  }

  void append(hid_t dataset, std::size_t width, const void* values) {
    const int rank = width == 1 ? 1 : 2;
    const hsize_t begin[] = {saved, 0};
    const hsize_t count[] = {pending.size(), width};
    const hsize_t extent[] = {saved + pending.size(), width};
    bool done = H5Dset_extent(dataset, extent) >= 0;
    const Hdf5Handle type(H5Dget_type(dataset), H5Tclose);
    const Hdf5Handle there(H5Dget_space(dataset), H5Sclose);
    const Hdf5Handle here(H5Screate_simple(rank, count, nullptr), H5Sclose);
    done = done &&
           H5Sselect_hyperslab(there.get(), H5S_SELECT_SET, begin, nullptr, count, nullptr) >= 0 &&
           H5Dwrite(dataset, type.get(), here.get(), there.get(), H5P_DEFAULT, values) >= 0 &&
           H5Dflush(dataset) >= 0;
    if (!done) {
      fail();
    }
  }

  [[noreturn]] void fail() {
    const std::string reason = hdf5_failure();
    failed = true;
    if (file.valid()) {
      give_up_hdf5_file(file.get());
    }
    close();
    throw Error(
        Fault::system,
        fmt::format("{}: cannot be written: {}; it holds {} frames and can be read; free or "
                    "repair the disk and record to another file",
                    path.string(), reason, saved));
  }

  void close() {
    datasets.clear();
    const Hdf5Handle closing = std::exchange(file, Hdf5Handle(H5I_INVALID_HID, H5Fclose));
  }

  std::filesystem::path path;
  SensorDescription sensor;
  bool has_device_time = false;
  bool failed = false;
  Rows pending;
  Clock::time_point oldest_pending;
  std::uint64_t saved = 0;
  std::uint64_t frames = 0;
  std::uint64_t lost = 0;
  std::uint64_t lost_since = 0;  // before the next frame
  std::uint64_t unreadable = 0;
  std::uint64_t with_pose = 0;
  std::uint64_t unknown_readings = 0;

  // Open from the first save on.
  Hdf5Handle file{H5I_INVALID_HID, H5Fclose};
  std::map<std::string_view, Hdf5Handle> datasets;
};

FrameRecorder::FrameRecorder(std::filesystem::path path, SensorDescription sensor)
    : impl_(std::make_unique<Impl>(std::move(path), std::move(sensor))) {
  impl_->require_recordable();
}

FrameRecorder::~FrameRecorder() {
  if (impl_->failed) {
    return;
  }
  try {
    close();
  } catch (const std::exception& error) {
    log_message(LogLevel::error, error.what());  // callers who want to know call close()
  }
}

void FrameRecorder::add(const Frame& frame) {
  Impl& r = *impl_;
  if (frame.values.size() != r.sensor.elements_mm.size()) {
    refuse(r.path, "a frame has {} values but the sensor {} elements; record one array",
           frame.values.size(), r.sensor.elements_mm.size());
  }
  count_lost(r.lost, frame.lost_before);
  count_lost(r.lost_since, frame.lost_before);
  if (!is_readable(frame, r.sensor.valid)) {
    count_lost(r.lost, 1);
    count_lost(r.lost_since, 1);
    ++r.unreadable;
    return;
  }
  Rows& rows = r.pending;
  if (rows.size() == 0) {
    r.oldest_pending = Clock::now();
  }
  for (std::size_t i = 0; i < frame.values.size(); ++i) {
    const bool none = r.alive(i) && !is_known(frame.values[i]);
    rows.pressure.push_back(static_cast<float>(none ? unknown : frame.values[i]));
    r.unknown_readings += none ? 1 : 0;
  }
  // A pose that is not finite is dropped; its frame is kept.
  const bool posed = frame.T_robot_sensor && is_finite(*frame.T_robot_sensor);
  rows.sensor_pose.push_back(posed ? *frame.T_robot_sensor : unknown_pose);
  const double device_time_s = frame.device_time_s.value_or(unknown);
  rows.device_time_s.push_back(std::isfinite(device_time_s) ? device_time_s : unknown);
  rows.lost_before.push_back(std::exchange(r.lost_since, 0));
  rows.time_s.push_back(frame.host_time_s);
  r.with_pose += posed ? 1 : 0;
  ++r.frames;
  if (r.due()) {
    r.save();
  }
}

void FrameRecorder::flush() { impl_->save(); }

void FrameRecorder::close() {
  impl_->save();
  const Hdf5Session session;
  if (impl_->file.valid() && H5Fflush(impl_->file.get(), H5F_SCOPE_GLOBAL) < 0) {
    impl_->fail();
  }
  impl_->close();
}

std::uint64_t FrameRecorder::frames() const { return impl_->frames; }
std::uint64_t FrameRecorder::lost() const { return impl_->lost; }
std::uint64_t FrameRecorder::with_pose() const { return impl_->with_pose; }
std::uint64_t FrameRecorder::unreadable() const { return impl_->unreadable; }
std::uint64_t FrameRecorder::unknown_readings() const { return impl_->unknown_readings; }

}  // namespace palpate
