#include <cmath>
#include <functional>
#include <limits>
#include <span>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "io/file_format.hpp"
#include "io/file_summary.hpp"
#include "io/hdf5_contents.hpp"
#include "io/hdf5_writer.hpp"
#include "io/input_file.hpp"
#include "io/recording_rules.hpp"
#include "palpate/error.hpp"

namespace palpate {

namespace {

Axis read_axis(const Hdf5Contents& file, const char* range, const char* bins) {
  const std::vector<double> ends = file.numbers(range, 2);
  return {ends[0], ends[1], file.integer(bins, 1)};
}

// Checks the labels and the lattice of a posterior that is read or about to be written.
void validate(const std::filesystem::path& path, const std::vector<std::string>& objects,
              const PoseLattice& lattice) {
  // HDF5 keeps an attribute of at most 64 KiB, 16 bytes for each text.
  constexpr std::size_t most_objects = 4000;
  if (objects.empty() || objects.size() > most_objects) {
    refuse(path, "attribute 'objects' has {} labels; store 1 to {}", objects.size(), most_objects);
  }
  for (const std::string& label : objects) {
    require_text(path, "attribute 'objects'", label);
  }
  try {
    lattice.validate();
  } catch (const Error& error) {
    refuse(path, "{}", error.what());
  }
}

void require_log_likelihoods(const std::filesystem::path& path,
                             std::span<const double> log_likelihood) {
  for (const double value : log_likelihood) {
    // A bin may be impossible (-inf), but not better than certain (+inf).
    if (std::isnan(value) || value == std::numeric_limits<double>::infinity()) {
      refuse(path, "dataset 'log_likelihood' holds {}; store numbers or -inf", value);
    }
  }
}

std::vector<std::uint64_t> shape_of(std::size_t objects, const PoseLattice& lattice) {
  return {objects, static_cast<std::uint64_t>(lattice.theta_rad.count),
          static_cast<std::uint64_t>(lattice.y_mm.count),
          static_cast<std::uint64_t>(lattice.x_mm.count)};
}

void require_share(const std::filesystem::path& path, double rest_mass_bound) {
  if (!(rest_mass_bound >= 0.0 && rest_mass_bound <= 1.0)) {
    refuse(path, "attribute 'rest_mass_bound' = {}; store a share from 0 to 1", rest_mass_bound);
  }
}

/// All bins of all objects. @throws Error where they are too many to be numbered
std::int64_t numbered_bins(const std::filesystem::path& path, const Posterior& posterior) {
  const std::vector<std::uint64_t> shape = shape_of(posterior.objects.size(), posterior.lattice);
  const std::uint64_t bins = stored_bytes(shape, 1);
  if (bins > std::numeric_limits<std::int64_t>::max()) {
    refuse(path, "{} bins are too many to be numbered; store fewer", shape);
  }
  return static_cast<std::int64_t>(bins);
}

/// The rows of `index`, [n, 4] of object, theta, y and x, as places among all bins.
std::vector<std::int64_t> read_index(const std::filesystem::path& path, const Hdf5Contents& file,
                                     const Posterior& posterior) {
  numbered_bins(path, posterior);
  const std::uint64_t rows = file.shape("log_likelihood", 1)[0];
  if (const auto& shape = file.shape("index", 2); shape != std::vector<std::uint64_t>{rows, 4}) {
    file.refuse("dataset 'index' has the shape {}; 'log_likelihood' makes it [{}, 4]", shape, rows);
  }
  const std::vector<std::uint64_t> counts = shape_of(posterior.objects.size(), posterior.lattice);
  std::vector<std::int64_t> index;
  index.reserve(rows);
  std::size_t column = 0;
  std::int64_t place = 0;
  file.read("index", [&](std::uint64_t, std::span<const double> values) {
    for (const double value : values) {
      const std::uint64_t count = counts[column];
      if (!(value >= 0.0 && value < static_cast<double>(count) && value == std::floor(value))) {
        refuse(path,
               "dataset 'index' holds {} in column {}; store object, theta, y and x, counted "
               "from 0, each below its number of bins, here {}",
               value, column, count);
      }
      place = place * static_cast<std::int64_t>(count) + static_cast<std::int64_t>(value);
      if (++column == counts.size()) {
        index.push_back(place);
        column = 0;
        place = 0;
      }
    }
  });
  return index;
}

Hdf5Contents open_posterior(const std::filesystem::path& path) {
  return {path,
          {"format", "version", "objects", "bins_x", "bins_y", "bins_theta", "x_mm", "y_mm",
           "theta_rad", "pivot_mm", "rest_mass_bound"},
          {"log_likelihood", "index"}};
}

/// Reads and checks the posterior without its log-likelihoods.
Posterior read_posterior_head(const std::filesystem::path& path, const Hdf5Contents& file) {
  const int version = require_format(file, posterior_format, evaluated_version);
  Posterior posterior;
  posterior.objects = file.texts("objects");
  PoseLattice& lattice = posterior.lattice;
  lattice.x_mm = read_axis(file, "x_mm", "bins_x");
  lattice.y_mm = read_axis(file, "y_mm", "bins_y");
  lattice.theta_rad = read_axis(file, "theta_rad", "bins_theta");
  const std::vector<double> pivot = file.numbers("pivot_mm", 2);
  lattice.pivot_mm = {pivot[0], pivot[1]};
  validate(path, posterior.objects, lattice);
  const std::vector<std::uint64_t> expected = shape_of(posterior.objects.size(), lattice);
  if (version == evaluated_version) {
    posterior.rest_mass_bound = file.number("rest_mass_bound");
    require_share(path, *posterior.rest_mass_bound);
    posterior.index = read_index(path, file, posterior);
  } else if (const auto& shape = file.shape("log_likelihood", 4); shape != expected) {
    file.refuse("dataset 'log_likelihood' has the shape {}; its attributes make it {}", shape,
                expected);
  }
  return posterior;
}

void write_posterior_head(Hdf5Writer& file, int version, const std::vector<std::string>& objects,
                          const PoseLattice& lattice) {
  write_format(file, posterior_format, version);
  file.attribute("objects", objects);
  file.attribute("bins_x", lattice.x_mm.count);
  file.attribute("bins_y", lattice.y_mm.count);
  file.attribute("bins_theta", lattice.theta_rad.count);
  file.attribute("x_mm", {lattice.x_mm.lower, lattice.x_mm.upper});
  file.attribute("y_mm", {lattice.y_mm.lower, lattice.y_mm.upper});
  file.attribute("theta_rad", {lattice.theta_rad.lower, lattice.theta_rad.upper});
  file.attribute("pivot_mm", {lattice.pivot_mm.x, lattice.pivot_mm.y});
}

void write_evaluated(const std::filesystem::path& path, const Posterior& posterior) {
  const PoseLattice& lattice = posterior.lattice;
  const std::size_t rows = posterior.index.size();
  if (posterior.log_likelihood.size() != rows) {
    refuse(path, "an index of {} bins and {} log-likelihoods cannot be written; make them agree",
           rows, posterior.log_likelihood.size());
  }
  require_log_likelihoods(path, posterior.log_likelihood);
  require_share(path, *posterior.rest_mass_bound);
  const std::int64_t bins = numbered_bins(path, posterior);
  std::vector<std::int32_t> index;
  index.reserve(4 * rows);
  for (const std::int64_t place : posterior.index) {
    if (place < 0 || place >= bins) {
      refuse(path, "index: {} is no bin of {}; number them from 0", place, bins);
    }
    const std::int64_t bin = place % lattice.bins();
    const std::int64_t in_plane = bin % lattice.plane();
    for (const std::int64_t part : {place / lattice.bins(), bin / lattice.plane(),
                                    in_plane / lattice.x_mm.count, in_plane % lattice.x_mm.count}) {
      index.push_back(static_cast<std::int32_t>(part));
    }
  }
  // HDF5 has no chunks of nothing.
  const Hdf5Writer::Storage storage =
      rows > 0 ? Hdf5Writer::Storage::compressed : Hdf5Writer::Storage::plain;
  Hdf5Writer file(path);
  write_posterior_head(file, evaluated_version, posterior.objects, lattice);
  file.attribute("rest_mass_bound", *posterior.rest_mass_bound);
  file.dataset("index", {rows, 4}, index, storage);
  file.dataset("log_likelihood", {rows}, posterior.log_likelihood, storage);
  file.save();
}

}  // namespace

PosteriorSummary summarize_posterior(const std::filesystem::path& path) {
  const Hdf5Contents file = open_posterior(path);
  PosteriorSummary summary{.head = read_posterior_head(path, file), .peaks = {}};
  const Posterior& head = summary.head;
  const std::int64_t bins = head.lattice.bins();
  summary.peaks.assign(head.objects.size(), {-std::numeric_limits<double>::infinity(), 0});
  file.read("log_likelihood", [&](std::uint64_t first, std::span<const double> values) {
    require_log_likelihoods(path, values);
    for (std::size_t i = 0; i < values.size(); ++i) {
      const std::int64_t place =
          head.rest_mass_bound ? head.index[first + i] : static_cast<std::int64_t>(first + i);
      PosteriorSummary::Peak& peak = summary.peaks[static_cast<std::size_t>(place / bins)];
      if (values[i] > peak.log_likelihood) {
        peak = {values[i], place % bins};
      }
    }
  });
  return summary;
}

Posterior read_posterior(const std::filesystem::path& path) {
  const Hdf5Contents file = open_posterior(path);
  Posterior posterior = read_posterior_head(path, file);
  posterior.log_likelihood.reserve(file.size("log_likelihood"));
  file.read("log_likelihood", [&](std::uint64_t, std::span<const double> values) {
    require_log_likelihoods(path, values);
    posterior.log_likelihood.insert(posterior.log_likelihood.end(), values.begin(), values.end());
  });
  return posterior;
}

void write_posterior(const std::filesystem::path& path, const std::vector<std::string>& objects,
                     const PoseLattice& lattice,
                     const std::function<std::vector<double>(std::size_t object)>& log_likelihood) {
  validate(path, objects, lattice);
  Hdf5Writer file(path);
  write_posterior_head(file, format_version, objects, lattice);
  const std::vector<std::uint64_t> shape = shape_of(objects.size(), lattice);
  const std::uint64_t bins = stored_bytes(shape_of(1, lattice), 1);
  file.dataset(
      "log_likelihood", {shape.begin(), shape.end()},
      [&](std::size_t object) {
        std::vector<double> values = log_likelihood(object);
        if (values.size() != bins) {
          refuse(path, "object '{}': {} bins and {} log-likelihoods; make them agree",
                 objects[object], bins, values.size());
        }
        require_log_likelihoods(path, values);
        return values;
      },
      Hdf5Writer::Storage::compressed);
  file.save();
}

void write_posterior(const std::filesystem::path& path, const Posterior& posterior) {
  const auto& [objects, lattice, logs, rest_mass_bound, index] = posterior;
  validate(path, objects, lattice);
  if (rest_mass_bound) {
    write_evaluated(path, posterior);
    return;
  }
  if (logs.size() != stored_bytes(shape_of(objects.size(), lattice), 1)) {
    refuse(path, "a posterior of {} bins and {} log-likelihoods cannot be written; make them agree",
           fmt::format("{}", fmt::join(shape_of(objects.size(), lattice), " x ")), logs.size());
  }
  write_posterior(path, objects, lattice, [&posterior](std::size_t object) {
    const std::size_t bins = posterior.log_likelihood.size() / posterior.objects.size();
    const double* first = posterior.log_likelihood.data() + object * bins;
    return std::vector<double>(first, first + bins);
  });
}

}  // namespace palpate
