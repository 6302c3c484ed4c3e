#include <cmath>
#include <functional>
#include <limits>
#include <span>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "io/available_memory.hpp"
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

/// Reads and checks a posterior's file, holding a few MB of it at a time.
/// @param head called with the posterior without log-likelihoods
/// @param log_likelihood called with the log-likelihoods, object by object, in pieces
void scan_posterior(const std::filesystem::path& path,
                    const std::function<void(const Posterior&)>& head,
                    const std::function<void(std::span<const double>)>& log_likelihood) {
  Hdf5Contents file(path,
                    {"format", "version", "objects", "bins_x", "bins_y", "bins_theta", "x_mm",
                     "y_mm", "theta_rad", "pivot_mm"},
                    {"log_likelihood"});
  require_format(file, posterior_format);
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
  if (const auto& shape = file.shape("log_likelihood", 4); shape != expected) {
    file.refuse("dataset 'log_likelihood' has the shape {}; its attributes make it {}", shape,
                expected);
  }
  head(posterior);
  file.read("log_likelihood", [&](std::uint64_t, std::span<const double> values) {
    require_log_likelihoods(path, values);
    log_likelihood(values);
  });
}

}  // namespace

PosteriorSummary summarize_posterior(const std::filesystem::path& path) {
  PosteriorSummary summary;
  std::size_t bins = 0;
  std::size_t k = 0;
  scan_posterior(
      path,
      [&](const Posterior& head) {
        summary.head = head;
        bins = static_cast<std::size_t>(head.lattice.bins());
        summary.peaks.assign(head.objects.size(), {-std::numeric_limits<double>::infinity(), 0});
      },
      [&](std::span<const double> values) {
        for (const double value : values) {
          PosteriorSummary::Peak& peak = summary.peaks[k / bins];
          if (value > peak.log_likelihood) {
            peak = {value, static_cast<std::int64_t>(k % bins)};
          }
          ++k;
        }
      });
  return summary;
}

Posterior read_posterior(const std::filesystem::path& path) {
  Posterior posterior;
  scan_posterior(
      path,
      [&](const Posterior& head) {
        posterior = head;
        const std::vector<std::uint64_t> shape =
            shape_of(posterior.objects.size(), posterior.lattice);
        require_memory(path, fmt::format("a posterior of {} bins", fmt::join(shape, " x ")),
                       stored_bytes(shape, sizeof(double)));
        posterior.log_likelihood.reserve(stored_bytes(shape, 1));
      },
      [&](std::span<const double> values) {
        posterior.log_likelihood.insert(posterior.log_likelihood.end(), values.begin(),
                                        values.end());
      });
  return posterior;
}

void write_posterior(const std::filesystem::path& path, const std::vector<std::string>& objects,
                     const PoseLattice& lattice,
                     const std::function<std::vector<double>(std::size_t object)>& log_likelihood) {
  validate(path, objects, lattice);
  Hdf5Writer file(path);
  write_format(file, posterior_format);
  file.attribute("objects", objects);
  file.attribute("bins_x", lattice.x_mm.count);
  file.attribute("bins_y", lattice.y_mm.count);
  file.attribute("bins_theta", lattice.theta_rad.count);
  file.attribute("x_mm", {lattice.x_mm.lower, lattice.x_mm.upper});
  file.attribute("y_mm", {lattice.y_mm.lower, lattice.y_mm.upper});
  file.attribute("theta_rad", {lattice.theta_rad.lower, lattice.theta_rad.upper});
  file.attribute("pivot_mm", {lattice.pivot_mm.x, lattice.pivot_mm.y});
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
  const auto& [objects, lattice, logs] = posterior;
  validate(path, objects, lattice);
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
