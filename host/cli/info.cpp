#include "commands.hpp"

#include <algorithm>
#include <cmath>
#include <memory>
#include <numeric>
#include <string>

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <CLI/CLI.hpp>

#include "options.hpp"
#include "palpate/error.hpp"
#include "palpate/files.hpp"

namespace palpate::cli {

namespace {

/// What the elements that are alive read; a dead one's pressure may be anything, and a frame's may
/// be NaN, Unknown.
std::vector<double> live_pressures(const Recording& r, std::size_t& unknown) {
  std::vector<double> pressures;
  for (std::size_t k = 0; k < r.pressure.size(); ++k) {
    if (r.valid.empty() || r.valid[k % r.valid.size()] != 0) {
      if (std::isnan(r.pressure[k])) {
        ++unknown;
      } else {
        pressures.push_back(r.pressure[k]);
      }
    }
  }
  return pressures;
}

/// What a stream of frames has besides.
void print_stream(const Recording& r) {
  if (!r.time_s.empty() && r.time_s.back() > r.time_s.front()) {
    fmt::print("  rate              {:.1f} Hz\n",
               static_cast<double>(r.size() - 1) / (r.time_s.back() - r.time_s.front()));
  }
  if (!r.lost_before.empty()) {
    fmt::print("  lost              {} frames\n",
               std::accumulate(r.lost_before.begin(), r.lost_before.end(), std::uint64_t{0}));
  }
  const auto posed = std::count_if(r.T_robot_sensor.begin(), r.T_robot_sensor.end(),
                                   [](const Pose& pose) { return !std::isnan(pose.theta_rad); });
  fmt::print("  with a pose       {} frames\n", posed);
  if (r.baseline.empty()) {
    fmt::print("  baseline          none\n");
  } else {
    const auto [least, most] = std::minmax_element(r.baseline.begin(), r.baseline.end());
    fmt::print("  baseline          {:.3g} to {:.3g} {}\n", *least, *most, r.pressure_unit);
  }
  if (!r.sensor.empty()) {
    fmt::print("  sensor            {}{}\n", r.sensor,
               r.serial.empty() ? "" : ", serial " + r.serial);
  }
  fmt::print("  closed            {}\n",
             r.closed ? "yes" : "no: it is being recorded, or was cut off");
}

void print_recording(const std::string& path) {
  const Recording r = read_recording(path);
  fmt::print("{}: recording of {}\n", path, r.object.empty() ? "an unknown object" : r.object);
  fmt::print("  {}           {}\n", r.rows, r.size());
  fmt::print("  elements          {}{}\n", r.elements(),
             r.elements_mm.size() == r.elements() ? "" : ", positions change per touch");
  std::size_t unknown = 0;
  if (const std::vector<double> pressures = live_pressures(r, unknown); !pressures.empty()) {
    const auto [least, most] = std::minmax_element(pressures.begin(), pressures.end());
    fmt::print("  pressure          {:.3g} to {:.3g} {}\n", *least, *most, r.pressure_unit);
  }
  if (unknown > 0) {
    fmt::print("  unknown readings  {} of {}\n", unknown, r.pressure.size());
  }
  if (!r.valid.empty()) {
    fmt::print("  dead readings     {} of {}\n", std::count(r.valid.begin(), r.valid.end(), 0),
               r.valid.size());
  }
  if (!r.time_s.empty()) {
    fmt::print("  duration          {:.3f} s\n", r.time_s.back() - r.time_s.front());
  }
  if (r.rows == "frames") {
    print_stream(r);
  }
  if (r.truth) {
    const Pose& T = r.truth->T_object_robot;
    fmt::print("  truth             {} at x {:.3f} mm, y {:.3f} mm, theta {:.2f} deg\n",
               r.truth->object, T.translation_mm.x, T.translation_mm.y, degrees(T.theta_rad));
  }
}

void print_map(const std::string& path) {
  const OccupancyGrid m = read_map(path);
  const auto [least, most] = std::minmax_element(m.log_odds.begin(), m.log_odds.end());
  const auto occupied =
      std::count_if(m.log_odds.begin(), m.log_odds.end(), [](float l) { return l > 0.0F; });
  fmt::print("{}: map of {}\n", path, m.label);
  fmt::print("  cells             {} x {} of {} mm, {:.1f} x {:.1f} mm\n", m.nx, m.ny, m.cell_mm,
             m.nx * m.cell_mm, m.ny * m.cell_mm);
  fmt::print("  origin            {:.3f}, {:.3f} mm, centre of cell (0, 0)\n", m.origin_mm.x,
             m.origin_mm.y);
  if (m.spread_mm) {
    fmt::print("  spread            {} mm, of the sensor model that built it\n", *m.spread_mm);
  }
  fmt::print("  prior             {:.4f}, log odds {:.3f}\n", m.prior, m.prior_log_odds());
  fmt::print("  log odds          {:.3f} to {:.3f} nats\n", *least, *most);
  fmt::print("  occupied          {} cells, {:.1f} mm2\n", occupied,
             static_cast<double>(occupied) * m.cell_mm * m.cell_mm);
  fmt::print("  symmetry          {}\n", m.symmetry == 0 ? "full" : fmt::format("{}", m.symmetry));
}

void print_posterior(const std::string& path) {
  const Posterior p = read_posterior(path);
  const PoseLattice& lattice = p.lattice;
  fmt::print("{}: posterior over {}\n", path, fmt::join(p.objects, ", "));
  fmt::print("  bins              {} x {} x {} (x, y, theta) per object\n", lattice.x_mm.count,
             lattice.y_mm.count, lattice.theta_rad.count);
  fmt::print("  x, y              {} to {} mm, {} to {} mm\n", lattice.x_mm.lower,
             lattice.x_mm.upper, lattice.y_mm.lower, lattice.y_mm.upper);
  fmt::print("  theta             {:.1f} to {:.1f} deg\n", degrees(lattice.theta_rad.lower),
             degrees(lattice.theta_rad.upper));
  fmt::print("  pivot             {}, {} mm\n", lattice.pivot_mm.x, lattice.pivot_mm.y);
  const auto bins = static_cast<std::size_t>(lattice.bins());
  for (std::size_t i = 0; i < p.objects.size(); ++i) {
    const auto begin = p.log_likelihood.begin() + static_cast<std::ptrdiff_t>(i * bins);
    const auto most = std::max_element(begin, begin + static_cast<std::ptrdiff_t>(bins));
    const Pose T = lattice.T_object_robot(most - begin);
    fmt::print("  {:16}  largest {:.3f} nats at x {:.2f} mm, y {:.2f} mm, theta {:.1f} deg\n",
               p.objects[i], *most, T.translation_mm.x, T.translation_mm.y, degrees(T.theta_rad));
  }
}

void print_info(const std::string& path) {
  const std::string format = read_format(path);
  if (format == "palpate.recording") {
    print_recording(path);
  } else if (format == "palpate.map") {
    print_map(path);
  } else if (format == "palpate.posterior") {
    print_posterior(path);
  } else {
    throw Error(Fault::input,
                fmt::format("{}: format '{}' is not known; give a recording, a map or "
                            "a posterior",
                            path, format));
  }
}

}  // namespace

void add_info(CLI::App& app) {
  auto* command = app.add_subcommand("info", "Say what a recording, a map or a posterior holds");
  const auto path = std::make_shared<std::string>();
  command->add_option("FILE", *path, "HDF5 file")->required();
  command->callback([path] { print_info(*path); });
}

}  // namespace palpate::cli
