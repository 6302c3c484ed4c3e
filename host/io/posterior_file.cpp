#include <cmath>
#include <limits>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "file_format.hpp"
#include "hdf5_contents.hpp"
#include "hdf5_writer.hpp"
#include "input_file.hpp"
#include "palpate/error.hpp"
#include "palpate/files.hpp"

namespace palpate {

namespace {

Axis read_axis(const Hdf5Contents& file, const char* range, const char* bins) {
  const std::vector<double> ends = file.numbers(range, 2);
  return {ends[0], ends[1], file.integer(bins, 1)};
}

// What holds for every posterior, read or about to be written.
void validate(const std::filesystem::path& path, const Posterior& posterior) {
  try {
    posterior.lattice.validate();
  } catch (const Error& error) {
    refuse(path, error.what());
  }
  for (const double value : posterior.log_likelihood) {
    // A bin may be impossible, but not better than certain.
    if (std::isnan(value) || value == std::numeric_limits<double>::infinity()) {
      refuse(path, fmt::format("dataset 'log_likelihood' holds {}; store numbers or -inf", value));
    }
  }
}

}  // namespace

Posterior read_posterior(const std::filesystem::path& path) {
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
  Hdf5Value& log_likelihood = file.dataset("log_likelihood", 4);
  const std::vector<std::uint64_t> expected{posterior.objects.size(),
                                            static_cast<std::uint64_t>(lattice.theta_rad.count),
                                            static_cast<std::uint64_t>(lattice.y_mm.count),
                                            static_cast<std::uint64_t>(lattice.x_mm.count)};
  if (log_likelihood.shape != expected) {
    file.refuse(fmt::format("dataset 'log_likelihood' has the shape {}; its attributes make it {}",
                            log_likelihood.shape, expected));
  }
  posterior.log_likelihood = std::move(log_likelihood.numbers);
  validate(path, posterior);
  return posterior;
}

void write_posterior(const std::filesystem::path& path, const Posterior& posterior) {
  const PoseLattice& lattice = posterior.lattice;
  validate(path, posterior);
  const std::size_t objects = posterior.objects.size();
  if (objects == 0 ||
      posterior.log_likelihood.size() != objects * static_cast<std::size_t>(lattice.bins())) {
    refuse(path, fmt::format("a posterior of {} objects, {} bins and {} log-likelihoods cannot be "
                             "written; make them agree",
                             objects, lattice.bins(), posterior.log_likelihood.size()));
  }
  Hdf5Writer file(path);
  file.attribute("format", posterior_format);
  file.attribute("version", format_version);
  file.attribute("objects", posterior.objects);
  file.attribute("bins_x", lattice.x_mm.count);
  file.attribute("bins_y", lattice.y_mm.count);
  file.attribute("bins_theta", lattice.theta_rad.count);
  file.attribute("x_mm", {lattice.x_mm.lower, lattice.x_mm.upper});
  file.attribute("y_mm", {lattice.y_mm.lower, lattice.y_mm.upper});
  file.attribute("theta_rad", {lattice.theta_rad.lower, lattice.theta_rad.upper});
  file.attribute("pivot_mm", {lattice.pivot_mm.x, lattice.pivot_mm.y});
  file.dataset(
      "log_likelihood",
      {objects, static_cast<std::size_t>(lattice.theta_rad.count),
       static_cast<std::size_t>(lattice.y_mm.count), static_cast<std::size_t>(lattice.x_mm.count)},
      posterior.log_likelihood, Hdf5Writer::Storage::compressed);
  file.save();
}

}  // namespace palpate
