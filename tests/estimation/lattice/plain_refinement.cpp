#include "plain_refinement.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "reference/reference.hpp"
#include "support/synthetic.hpp"

namespace palpate {

namespace {

bool is_circle(const Axis& theta_rad) {
  return std::abs(theta_rad.upper - theta_rad.lower - two_pi) < 1e-9;
}

/// Steps from bin a to bin b of theta, the short way round a circle.
int turn_steps(const Axis& theta_rad, int a, int b) {
  const int n = theta_rad.count;
  int steps = b - a;
  if (is_circle(theta_rad)) {
    steps = ((steps + (n - 1) / 2) % n + n) % n - (n - 1) / 2;
  }
  return steps;
}

/// A bin of the window: how far from the mean it moves the object, in mm, and its log-likelihood.
struct Moved {
  double mm[3];
  double log;
};

/// Root mean square distance of the bins from their mean under weights belief^root; under equal
/// weights for a root of 0.
double plain_spread_mm(const std::vector<Moved>& window, double root) {
  double top = -1e300;
  for (const Moved& bin : window) {
    top = std::max(top, bin.log);
  }
  const auto weight = [&](const Moved& bin) {
    return root > 0.0 ? std::exp((bin.log - top) / root) : 1.0;
  };
  double total = 0.0;
  double mean[3] = {};
  for (const Moved& bin : window) {
    total += weight(bin);
    for (int a = 0; a < 3; ++a) {
      mean[a] += weight(bin) * bin.mm[a];
    }
  }
  double variance = 0.0;
  for (const Moved& bin : window) {
    for (int a = 0; a < 3; ++a) {
      const double from_mean = bin.mm[a] - mean[a] / total;
      variance += weight(bin) / total * from_mean * from_mean;
    }
  }
  return std::sqrt(variance);
}

/// The eighth root, or the one under which bins spread by a third of their own spread, between
/// doublings by the spread.
double plain_root(const std::vector<Moved>& window) {
  const double wanted = plain_spread_mm(window, 0.0) / 3.0;
  double root = 8.0;
  if (plain_spread_mm(window, root) >= wanted) {
    return root;
  }
  for (int i = 0; plain_spread_mm(window, 2.0 * root) < wanted; ++i) {
    if (i == 64) {
      return root;  // one bin has it all
    }
    root *= 2.0;
  }
  const double narrow = plain_spread_mm(window, root);
  const double wide = plain_spread_mm(window, 2.0 * root);
  return root * std::pow(2.0, (wanted - narrow) / (wide - narrow));
}

/// A quadratic's peak, relative to the mean of the bins, and where there is one, the inverse of
/// minus its second derivatives.
struct PlainPeak {
  std::array<double, 3> at{};
  double covariance[3][3] = {};
  bool found = false;
};

/// The peak of a quadratic over the axes that vary, by elimination with pivots; the mean where
/// there is none.
PlainPeak plain_peak(const std::vector<Moved>& window, double root, const bool (&varies)[3]) {
  std::vector<int> axes;
  for (int a = 0; a < 3; ++a) {
    if (varies[a]) {
      axes.push_back(a);
    }
  }
  const int d = static_cast<int>(axes.size());
  const int n = (d + 1) * (d + 2) / 2;
  if (d == 0 || static_cast<int>(window.size()) < 2 * n) {
    return {};
  }
  double top = -1e300;
  for (const Moved& bin : window) {
    top = std::max(top, bin.log);
  }
  // Rows of the normal equations, the right side last.
  std::vector<std::vector<double>> rows(n, std::vector<double>(n + 1));
  for (const Moved& bin : window) {
    std::vector<double> terms{1.0};
    double square = 0.0;
    for (const double mm : bin.mm) {
      square += mm * mm;
    }
    for (const int a : axes) {
      terms.push_back(bin.mm[a]);
    }
    for (int a = 0; a < d; ++a) {
      for (int b = a; b < d; ++b) {
        terms.push_back(bin.mm[axes[a]] * bin.mm[axes[b]]);
      }
    }
    terms.push_back(bin.log - top);
    const double weight = std::exp((bin.log - top) / root - square / (2.0 * 0.8 * 0.8));
    for (int i = 0; i < n; ++i) {
      for (int k = 0; k <= n; ++k) {
        rows[i][k] += weight * terms[i] * terms[k];
      }
    }
  }
  const auto eliminate = [](std::vector<std::vector<double>>& m) {
    const std::size_t size = m.size();
    for (std::size_t i = 0; i < size; ++i) {
      std::size_t pivot = i;
      for (std::size_t k = i; k < size; ++k) {
        pivot = std::abs(m[k][i]) > std::abs(m[pivot][i]) ? k : pivot;
      }
      std::swap(m[i], m[pivot]);
      if (std::abs(m[i][i]) < 1e-12) {
        return false;
      }
      for (std::size_t k = 0; k < size; ++k) {
        const double factor = k == i ? 0.0 : m[k][i] / m[i][i];
        for (std::size_t c = i; c <= size; ++c) {
          m[k][c] -= factor * m[i][c];
        }
      }
    }
    return true;
  };
  if (!eliminate(rows)) {
    return {};
  }
  const auto fit = [&](int i) { return rows[i][n] / rows[i][i]; };
  double h[3][3] = {};  // minus the second derivatives
  for (int a = 0, k = 1 + d; a < d; ++a) {
    for (int b = a; b < d; ++b, ++k) {
      h[a][b] -= fit(k);
      h[b][a] -= fit(k);
    }
  }
  // A maximum: every leading minor is positive.
  const double two = h[0][0] * h[1][1] - h[0][1] * h[1][0];
  const double three = h[0][0] * (h[1][1] * h[2][2] - h[1][2] * h[2][1]) -
                       h[0][1] * (h[1][0] * h[2][2] - h[1][2] * h[2][0]) +
                       h[0][2] * (h[1][0] * h[2][1] - h[1][1] * h[2][0]);
  if (h[0][0] <= 0.0 || (d > 1 && two <= 0.0) || (d > 2 && three <= 0.0)) {
    return {};
  }
  std::vector<std::vector<double>> newton;
  for (int a = 0; a < d; ++a) {
    newton.emplace_back(h[a], h[a] + d);
    newton.back().push_back(fit(1 + a));
  }
  std::array<double, 3> peak{};
  eliminate(newton);
  PlainPeak result;
  for (int a = 0; a < d; ++a) {
    peak[axes[a]] = newton[a][d] / newton[a][a];
    std::vector<std::vector<double>> column;
    for (int b = 0; b < d; ++b) {
      column.emplace_back(h[b], h[b] + d);
      column.back().push_back(a == b ? 1.0 : 0.0);
    }
    eliminate(column);
    for (int b = 0; b < d; ++b) {
      result.covariance[axes[a]][axes[b]] = column[b][d] / column[b][b];
    }
  }
  result.at = peak;
  result.found = std::hypot(peak[0], peak[1], peak[2]) <= 1.0;
  return result.found ? result : PlainPeak{};
}

}  // namespace

RefinedPose plain_refinement(const std::vector<double>& logs, const PoseLattice& lattice,
                             const OccupancyGrid& map, std::int64_t bin) {
  const int nx = lattice.x_mm.count;
  const int ny = lattice.y_mm.count;
  const int nt = lattice.theta_rad.count;
  const double step[] = {lattice.x_mm.step(), lattice.y_mm.step(), lattice.theta_rad.step()};
  const Body body = reference::body_of(map);
  int centre[] = {static_cast<int>(bin % nx), static_cast<int>(bin / nx % ny),
                  static_cast<int>(bin / nx / ny)};
  struct Inside {
    double d[3];
    double log;
    bool within;
    std::int64_t bin;
  };
  std::vector<Inside> window;
  double root = 0.0;
  double offset[3] = {};
  double place[3] = {};  // of the centre
  for (int pass = 0; pass < 3; ++pass) {
    const std::int64_t middle = (std::int64_t{centre[2]} * ny + centre[1]) * nx + centre[0];
    const Pose T = reference::bin_pose(lattice, middle);
    const glm::dvec2 centroid_robot = reference::transform_back(T, body.centroid_mm);
    window.clear();
    std::vector<Moved> displaced;
    double top = -1e300;
    for (std::int64_t k = 0; k < lattice.bins(); ++k) {
      const int steps[] = {static_cast<int>(k % nx) - centre[0],
                           static_cast<int>(k / nx % ny) - centre[1],
                           turn_steps(lattice.theta_rad, centre[2], static_cast<int>(k / nx / ny))};
      const glm::dvec2 moved =
          reference::transform(reference::bin_pose(lattice, k), centroid_robot) - body.centroid_mm;
      const double turn = steps[2] * step[2];
      const double displaced2 =
          moved.x * moved.x + moved.y * moved.y + body.inertia_mm2 * turn * turn;
      const bool neighbour =
          std::abs(steps[0]) <= 1 && std::abs(steps[1]) <= 1 && std::abs(steps[2]) <= 1;
      const bool within = displaced2 <= 2.5 * 2.5;
      if (within || neighbour) {
        window.push_back({{steps[0] * step[0], steps[1] * step[1], turn}, logs[k], within, k});
        top = std::max(top, logs[k]);
      }
      if (within) {
        displaced.push_back({{moved.x, moved.y, std::sqrt(body.inertia_mm2) * turn}, logs[k]});
      }
    }
    root = plain_root(displaced);
    double flattened = 0.0;
    double sum[3] = {};
    for (const Inside& in : window) {
      flattened += std::exp((in.log - top) / root);
      for (int a = 0; a < 3; ++a) {
        sum[a] += std::exp((in.log - top) / root) * in.d[a];
      }
    }
    for (int a = 0; a < 3; ++a) {
      offset[a] = sum[a] / flattened;
      const Axis& axis = a == 0 ? lattice.x_mm : a == 1 ? lattice.y_mm : lattice.theta_rad;
      place[a] = axis.centre(centre[a]);
      if (step[a] > 0.0) {
        centre[a] += static_cast<int>(std::lround(offset[a] / step[a]));
      }
    }
    centre[2] = (centre[2] + nt) % nt;
  }
  // Carried to the plain pose by differences of the map from parameters to poses.
  const auto plain = [&](double x, double y, double theta) {
    const double px = lattice.pivot_mm.x;
    const double py = lattice.pivot_mm.y;
    return std::array{x - (std::cos(theta) * px - std::sin(theta) * py),
                      y - (std::sin(theta) * px + std::cos(theta) * py), theta};
  };
  // How far a bin moves the object from where the mean has it.
  const auto mean_pose = plain(place[0] + offset[0], place[1] + offset[1], place[2] + offset[2]);
  const glm::dvec2 centroid_robot =
      reference::transform_back({{mean_pose[0], mean_pose[1]}, mean_pose[2]}, body.centroid_mm);
  const double spin_mm = std::sqrt(body.inertia_mm2);
  std::vector<Moved> moved_bins;
  for (const Inside& in : window) {
    if (in.within) {
      const glm::dvec2 by =
          reference::transform(reference::bin_pose(lattice, in.bin), centroid_robot) -
          body.centroid_mm;
      moved_bins.push_back({{by.x, by.y, spin_mm * (in.d[2] - offset[2])}, in.log});
    }
  }
  const PlainPeak fitted = plain_peak(moved_bins, 3.0 * root, {nx > 1, ny > 1, nt > 1});
  const std::array<double, 3>& peak = fitted.at;
  // The place at which the object has moved by that much.
  const double turn = peak[2] / spin_mm;
  const glm::dvec2 lever =
      body.centroid_mm - glm::dvec2(place[0] + offset[0], place[1] + offset[1]);
  const glm::dvec2 turned(std::cos(turn) * lever.x - std::sin(turn) * lever.y,
                          std::sin(turn) * lever.x + std::cos(turn) * lever.y);
  const double shift[] = {nx > 1 ? peak[0] - (turned.x - lever.x) : 0.0,
                          ny > 1 ? peak[1] - (turned.y - lever.y) : 0.0, turn};
  bool inside = true;
  for (int a = 0; a < 3; ++a) {
    const Axis& axis = a == 0 ? lattice.x_mm : a == 1 ? lattice.y_mm : lattice.theta_rad;
    const double at = place[a] + offset[a] + shift[a];
    inside = inside && ((a == 2 && is_circle(axis)) || (at >= axis.lower && at <= axis.upper));
  }
  double top = -1e300;
  double own = 0.0;
  double mean[3];
  double moment[3][3];
  for (const Inside& in : window) {
    top = std::max(top, in.log);
  }
  for (int a = 0; a < 3; ++a) {
    offset[a] += inside ? shift[a] : 0.0;
    mean[a] = place[a] + offset[a];
    for (int b = 0; b < 3; ++b) {
      moment[a][b] = 0.0;
    }
  }
  for (const Inside& in : window) {
    own += std::exp(in.log - top);
    for (int a = 0; a < 3; ++a) {
      for (int b = 0; b < 3; ++b) {
        moment[a][b] += std::exp(in.log - top) * (in.d[a] - offset[a]) * (in.d[b] - offset[b]);
      }
    }
  }
  for (int a = 0; a < 3; ++a) {
    for (int b = 0; b < 3; ++b) {
      moment[a][b] = moment[a][b] / own + (a == b ? step[a] * step[a] / 12.0 : 0.0);
    }
  }
  if (fitted.found && inside && plain_spread_mm(moved_bins, 1.0) <= 0.8) {
    // (x, y, theta) of a small motion of the body about the mean; fixed axes do not move.
    const double arm[] = {lever.y / spin_mm, -lever.x / spin_mm, 1.0 / spin_mm};
    const bool varies[] = {nx > 1, ny > 1, nt > 1};
    double slope[3][3] = {{1.0, 0.0, arm[0]}, {0.0, 1.0, arm[1]}, {0.0, 0.0, arm[2]}};
    for (int a = 0; a < 3; ++a) {
      for (int b = 0; b < 3; ++b) {
        moment[a][b] = 0.0;
        for (int k = 0; k < 9; ++k) {
          moment[a][b] += varies[a] && varies[b] && varies[k / 3] && varies[k % 3]
                              ? slope[a][k / 3] * fitted.covariance[k / 3][k % 3] * slope[b][k % 3]
                              : 0.0;
        }
      }
    }
  }
  double jacobian[3][3];
  for (int b = 0; b < 3; ++b) {
    constexpr double h = 1e-6;
    const auto at = [&](double d) {
      return plain(mean[0] + (b == 0 ? d : 0), mean[1] + (b == 1 ? d : 0),
                   mean[2] + (b == 2 ? d : 0));
    };
    for (int a = 0; a < 3; ++a) {
      jacobian[a][b] = (at(h)[a] - at(-h)[a]) / (2.0 * h);
    }
  }
  RefinedPose refined;
  const auto pose = plain(mean[0], mean[1], mean[2]);
  refined.T_object_robot = {{pose[0], pose[1]}, pose[2]};
  for (int a = 0; a < 3; ++a) {
    for (int b = 0; b < 3; ++b) {
      for (int k = 0; k < 9; ++k) {
        refined.covariance[3 * a + b] +=
            jacobian[a][k / 3] * moment[k / 3][k % 3] * jacobian[b][k % 3];
      }
    }
  }
  return refined;
}

}  // namespace palpate
