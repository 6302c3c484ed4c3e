#include <fmt/format.h>
#include <nanobind/stl/array.h>
#include <nanobind/stl/map.h>
#include <nanobind/stl/optional.h>
#include <nanobind/stl/shared_ptr.h>

#include "bindings.hpp"
#include "palpate/balanced_lattice.hpp"
#include "palpate/drawn_map.hpp"
#include "palpate/error.hpp"
#include "palpate/files.hpp"
#include "palpate/map_builder.hpp"
#include "palpate/occupancy_grid.hpp"
#include "palpate/pose_error.hpp"
#include "shared.hpp"
#include "touches.hpp"

namespace palpate::python {

using namespace nb::literals;

namespace {

std::vector<float> cells_of(const Floats& cells) { return {cells.data, cells.data + cells.size()}; }

/// [ny, nx], a view of cells of the map.
Result<const float, 2> view_cells(const OccupancyGrid& map, const std::vector<float>& cells) {
  return view<float, 2>(cells.data(),
                        {static_cast<std::size_t>(map.ny), static_cast<std::size_t>(map.nx)},
                        nb::find(map));
}

nb::object cells_or_none(const OccupancyGrid& map, const std::vector<float>& cells) {
  return cells.empty() ? nb::none() : nb::object(view_cells(map, cells));
}

/// The polygons of one array [n, 2], or of several.
std::vector<std::vector<glm::dvec2>> polygons_of(const ArrayLike& object) {
  const bool several = nb::isinstance<nb::sequence>(object) && nb::len(object) > 0 &&
                       nb::cast<int>(call("numpy", "ndim", object[0])) == 2;
  const nb::object all = several ? nb::borrow(object) : nb::make_tuple(object);
  std::vector<std::vector<glm::dvec2>> polygons;
  for (std::size_t i = 0; i < nb::len(all); ++i) {
    const std::string name = several ? fmt::format("polygon[{}]", i) : "polygon";
    polygons.push_back(points_of(all[i], name.c_str()));
    if (polygons[i].size() < 3) {
      throw Error(Fault::input,
                  fmt::format("polygon {} of {} vertices: give at least 3", i, polygons[i].size()));
    }
  }
  return polygons;
}

void bind_drawn_maps(nb::class_<OccupancyGrid>& grid) {
  const DrawnMapOptions usual;
  grid.def_static(
      "from_mask",
      [](const std::string& label, const ArrayLike& mask, double pixel_mm,
         const ArrayLike& origin_mm, double cell_mm, double spread_mm, double peak, double prior,
         double felt_share, double reach_mm) {
        const Bytes pixels = ArrayReader().pixels(mask, "mask", {"rows", "columns"});
        const Mask drawn{.pixel_mm = pixel_mm,
                         .origin_mm = point_of(origin_mm, "origin_mm"),
                         .rows = pixels.shape[0],
                         .columns = pixels.shape[1],
                         .occupied = pixels.copied()};
        const DrawnMapOptions options{cell_mm, spread_mm, peak, prior, felt_share, reach_mm};
        return run([&] { return drawn_map(label, drawn, options); });
      },
      "label"_a, "mask"_a, nb::kw_only(), "pixel_mm"_a, "origin_mm"_a, "cell_mm"_a = usual.cell_mm,
      "spread_mm"_a = usual.spread_mm, "peak"_a = usual.peak, "prior"_a = usual.prior,
      "felt_share"_a = usual.felt_share, "reach_mm"_a = usual.reach_mm,
      "The map of an object from a drawing of it, without touches.\n\n"
      "mask [rows, columns]: booleans, True where the object is. Pixel (j, i) is a square of\n"
      "pixel_mm centred at origin_mm + pixel_mm * (i, j) in the object frame: rows lie along +y,\n"
      "so that a picture, whose first row is its top, is given as picture[::-1]. origin_mm [2]:\n"
      "the centre of pixel (0, 0). cell_mm: edge of the map's cells. spread_mm: how soft edges\n"
      "are, half the standard deviation of the sensor's point spread, by default that of touched\n"
      "maps. peak: how sure the drawing is: log odds lie within log(peak / (1 - peak)), by\n"
      "default 6.9 nats. prior: probability that a place beyond the map is occupied. felt_share:\n"
      "share of an element's point spread on the object from which on it feels the object; by\n"
      "default 0.2, so that the object is 1.7 spreads larger all around, as touched maps have it;\n"
      "0.5 leaves outlines where they are drawn. reach_mm: largest distance of an element from\n"
      "the array's centre, by default the 6 x 6 DigiTacts region's; the map ends\n"
      "2 reach_mm + 4 spread_mm around the object.\n\n"
      "Raises Error on a mask that is not two-dimensional and of booleans, a mask without an\n"
      "occupied pixel, and numbers out of range.");
  grid.def_static(
      "from_polygon",
      [](const std::string& label, const ArrayLike& polygon, double cell_mm, double spread_mm,
         double peak, double prior, double felt_share, double reach_mm) {
        const DrawnMapOptions options{cell_mm, spread_mm, peak, prior, felt_share, reach_mm};
        const Shape shape{.label = label, .strokes = {}, .polygons = polygons_of(polygon)};
        return run([&] {
          options.validate();
          return drawn_map(label, mask_of(shape, options.cell_mm / pixels_of_cell), options);
        });
      },
      "label"_a, "polygon"_a, nb::kw_only(), "cell_mm"_a = usual.cell_mm,
      "spread_mm"_a = usual.spread_mm, "peak"_a = usual.peak, "prior"_a = usual.prior,
      "felt_share"_a = usual.felt_share, "reach_mm"_a = usual.reach_mm,
      "The map of an object from its outline, without touches.\n\n"
      "polygon [n, 2]: vertices in mm in the object frame, n at least 3, or a sequence of such\n"
      "arrays, which the even-odd rule fills: a polygon within another is a hole. The others as\n"
      "from_mask() has them.\n\n"
      "Raises Error on a polygon that is not [n, 2], has fewer than 3 vertices or covers no area,\n"
      "and on numbers out of range.");
}

void bind_map(nb::module_& module) {
  nb::class_<OccupancyGrid> grid(
      module, "OccupancyGrid",
      "The map of one object: log odds of occupancy, in nats, on a grid in the object frame. Cell\n"
      "(j, i) is centred at origin_mm + cell_mm * (i, j). Beyond the grid everything holds the\n"
      "prior.");
  grid.def(
          "__init__",
          [](OccupancyGrid* self, const std::string& label, const ArrayLike& log_odds,
             double cell_mm, const ArrayLike& origin_mm, double prior, int symmetry,
             std::optional<double> spread_mm, bool mirror,
             const std::optional<ArrayLike>& observations,
             const std::optional<ArrayLike>& mean_level) {
            ArrayReader reader;
            const auto cells = [&](const std::optional<ArrayLike>& given, const char* name) {
              return given ? reader.floats(*given, name, {"ny", "nx"}) : Floats();
            };
            OccupancyGrid map{.label = label,
                              .cell_mm = cell_mm,
                              .origin_mm = point_of(origin_mm, "origin_mm"),
                              .prior = prior,
                              .symmetry = symmetry,
                              .spread_mm = spread_mm,
                              .mirror = mirror};
            const Floats odds = cells(log_odds, "log_odds");
            map.log_odds = cells_of(odds);
            map.ny = static_cast<int>(odds.shape[0]);
            map.nx = static_cast<int>(odds.shape[1]);
            map.observations = cells_of(cells(observations, "observations"));
            map.mean_level = cells_of(cells(mean_level, "mean_level"));
            if (const auto fault = fault_of(map)) {
              throw Error(Fault::input, *fault);
            }
            new (self) OccupancyGrid(std::move(map));
          },
          "label"_a, "log_odds"_a, nb::kw_only(), "cell_mm"_a, "origin_mm"_a, "prior"_a = 0.2,
          "symmetry"_a = 1, "spread_mm"_a = nb::none(), "mirror"_a = false,
          "observations"_a = nb::none(), "mean_level"_a = nb::none(),
          "log_odds [ny, nx] in nats, copied; origin_mm [2], the centre of cell (0, 0); symmetry:\n"
          "n-fold rotational symmetry, 0 = full; spread_mm of the sensor model; mirror: the\n"
          "object may lie on its other side; observations [ny, nx]: touches that sensed each\n"
          "cell; mean_level [ny, nx]: mean pressure.\n\n"
          "Raises Error on a map that is not sound.")
      .def_ro("label", &OccupancyGrid::label, "Name of the object.")
      .def_ro("cell_mm", &OccupancyGrid::cell_mm, "Edge of a cell.")
      .def_prop_ro("origin_mm", array_of(&OccupancyGrid::origin_mm),
                   "[2], the centre of cell (0, 0) in the object frame.")
      .def_ro("prior", &OccupancyGrid::prior, "Probability that an unseen place is occupied.")
      .def_rw("symmetry", &OccupancyGrid::symmetry,
              "n-fold rotational symmetry; 0 = full, that of a disc.")
      .def_ro("spread_mm", &OccupancyGrid::spread_mm,
              "Of the sensor model that built the map, or None.")
      .def_ro("suggested_symmetry", &OccupancyGrid::suggested_symmetry,
              "The symmetry that the map itself shows; None where it was not measured.")
      .def_ro("drawn", &OccupancyGrid::drawn, "It is of a drawing, not of touches.")
      .def_prop_ro("T_learned_robot_object", array_of(&OccupancyGrid::T_learned_robot_object),
                   "[3], the object frame in the robot frame of the touches that it was learned\n"
                   "from: mm, mm, rad.")
      .def("centre_frame", &centre_frame,
           "Puts the object frame's origin on the cell nearest to the middle of the occupied\n"
           "cells. Poses then tell where the object itself is; a recording's truth keeps its\n"
           "meaning.")
      .def_rw("mirror", &OccupancyGrid::mirror, "The object may lie on its other side.")
      .def_ro("nx", &OccupancyGrid::nx, "Cells along x.")
      .def_ro("ny", &OccupancyGrid::ny, "Cells along y.")
      .def_prop_ro(
          "log_odds", [](const OccupancyGrid& self) { return view_cells(self, self.log_odds); },
          "[ny, nx] in nats: a read-only view, not a copy.")
      .def_prop_ro(
          "observations",
          [](const OccupancyGrid& self) { return cells_or_none(self, self.observations); },
          nb::sig("def observations(self) -> numpy.typing.NDArray[numpy.float32] | None"),
          "Touches that sensed each cell, [ny, nx], or None.")
      .def_prop_ro(
          "mean_level",
          [](const OccupancyGrid& self) { return cells_or_none(self, self.mean_level); },
          nb::sig("def mean_level(self) -> numpy.typing.NDArray[numpy.float32] | None"),
          "Mean pressure at each cell, [ny, nx], or None.")
      .def(
          "save",
          [](const OccupancyGrid& self, const PathLike& file) {
            // Another thread may change the map meanwhile.
            run([path = file.path(), copy = self] { write_map(path, copy); });
          },
          "path"_a, "Writes a map file (HDF5). Raises Error where it cannot be written.")
      .def("plot", plot_method, "ax"_a = nb::none(), plot_signature,
           "Draws occupied (red) and empty (blue) cells, in mm, with Matplotlib. Returns the axes.")
      .def("_repr_png_", png_method, png_signature)
      .def("__repr__", [](const OccupancyGrid& self) {
        return fmt::format("OccupancyGrid('{}', {} x {} cells of {:g} mm, prior {:.3g})",
                           self.label, self.nx, self.ny, self.cell_mm, self.prior);
      });
  bind_drawn_maps(grid);
  module.def(
      "read_map",
      [](const PathLike& file) { return run([path = file.path()] { return read_map(path); }); },
      "path"_a,
      "Reads a map file (HDF5). Raises Error naming file, field and remedy; see read_recording()\n"
      "for damaged files.");
}

void bind_hypothesis(nb::module_& module) {
  nb::class_<Hypothesis>(module, "Hypothesis",
                         "An object that the unknown may turn out to be. An OccupancyGrid stands "
                         "for one of weight 1.")
      .def(nb::init<const OccupancyGrid&, double>(), "map"_a, "weight"_a = 1.0,
           "weight: prior weight relative to the other objects.")
      .def_ro("map", &Hypothesis::map, "The map of the object.")
      .def_ro("weight", &Hypothesis::weight, "Prior weight relative to the other objects.")
      .def_ro("mirrored", &Hypothesis::mirrored, "The map is the mirror image of the learned one.")
      .def("__repr__", &repr_of);
}

void bind_metric(nb::module_& module) {
  module.def(
      "pose_error_mm",
      [](const OccupancyGrid& map, const ArrayLike& estimate, const ArrayLike& truth) {
        return pose_error_mm(body_of(map), map.symmetry, pose_of(estimate, "estimate"),
                             pose_of(truth, "truth"));
      },
      "map"_a, "estimate"_a, "truth"_a,
      "Root mean squared displacement, in mm, of the map's occupied cells between two poses\n"
      "T_object_robot [3] (Eq. 17-20). The map's symmetry makes turned poses equal.\n\n"
      "Raises Error where no cell is occupied.");
  module.def(
      "measure_symmetry",
      [](const OccupancyGrid& map) -> std::optional<int> {
        const auto measured = measure_symmetry(map);
        return measured ? std::optional(measured->suggested) : std::nullopt;
      },
      "map"_a,
      "The n-fold rotational symmetry that the map itself shows, 0 = full; None where fewer than\n"
      "16 cells are occupied.");
}

/// What bins are to resolve, by the name that --bins has for it.
BinWidth width_of(const std::string& bins) {
  if (bins != "auto" && bins != "fine") {
    throw Error(Fault::input, fmt::format("bins '{}': give 'auto' or 'fine'", bins));
  }
  return bins == "fine" ? BinWidth::fine : BinWidth::automatic;
}

void bind_lattices(nb::module_& module) {
  module.def(
      "balanced_lattice",
      [](const PoseLattice& region, const MapsLike& maps, const std::string& bins,
         std::int64_t most_bins) {
        return balanced_lattice(region, hypotheses_of(maps), most_bins, width_of(bins)).lattice;
      },
      "region"_a, "maps"_a, "bins"_a = "auto", "most_bins"_a = most_balanced_bins,
      "The bins that `palpate recognize --bins auto` or fine chooses for a region, whose own "
      "counts\n"
      "are ignored: as wide as the maps resolve. most_bins: limit for all objects together.");
  module.def(
      "touch_region",
      [](const MapsLike& maps, double reach_mm) {
        return touch_region(hypotheses_of(maps), reach_mm).lattice;
      },
      "maps"_a, "reach_mm"_a,
      "The poses of an object that an array touches, about the array's centre, as one bin.\n"
      "reach_mm: largest distance of an element from the array's centre.");
}

using Builder = Shared<MapBuilder>;

/// Touches that are added at once: some milliseconds of work, after which a call can stop.
constexpr std::size_t batch = 200;

void add_touches(const Builder& builder, const TouchesLike& touches, const Progress& progress) {
  const TouchViews views = views_of(touches);
  builder.use(progress, [&](MapBuilder& target, const Report& report) {
    const std::span<const Touch> all = views.touches;
    for (std::size_t begin = 0; begin < all.size(); begin += batch) {
      report(static_cast<double>(begin) / static_cast<double>(all.size()));
      target.add(all.subspan(begin, std::min(batch, all.size() - begin)));
    }
  });
}

}  // namespace

void bind_maps(nb::module_& module) {
  bind_lattices(module);
  bind_map(module);
  bind_hypothesis(module);
  bind_metric(module);
}

void bind_map_builder(nb::module_& module) {
  nb::class_<Builder>(
      module, "MapBuilder",
      "Builds an object's map from touches at known poses (Sec. II, Eq. 4-6), in any order. The\n"
      "object frame is the robot frame of the touches.")
      .def(
          "__init__",
          [](Builder* self, const std::shared_ptr<Device>& device, double cell_mm,
             const InverseSensorModel& sensor, const ContactClassifier& classifier) {
            const MapOptions options{
                .cell_mm = cell_mm, .sensor = sensor, .classifier = classifier};
            new (self) Builder(
                make_shared_on(device, [&](Device& on) { return MapBuilder(on, options); }));
          },
          "device"_a, nb::kw_only(), "cell_mm"_a = MapOptions{}.cell_mm,
          "sensor"_a = InverseSensorModel{}, "classifier"_a = ContactClassifier{},
          "cell_mm: edge of a cell. Raises Error on options out of range.")
      .def("add", &add_touches, "touches"_a, "progress"_a = nb::none(),
           "Adds the evidence of these touches.\n\n"
           "progress(fraction) is called up to 20 times a second. Ctrl-C stops the call after a\n"
           "part of the touches. Raises Error on a touch that is not sound.")
      .def("build", shared_method<Builder>(&MapBuilder::build), "label"_a,
           "The map of all touches so far. Raises Error if no element of any touch was In Contact\n"
           "or No Contact.")
      .def("clear", shared_method<Builder>(&MapBuilder::clear),
           "Forgets all touches, for the next object.")
      .def("__repr__", [](const Builder& self) {
        return fmt::format("MapBuilder(on '{}')", self.device().name());
      });
  module.def(
      "estimate_prior",
      [](Device& device, const std::map<std::string, TouchesLike>& objects, double cell_mm,
         const InverseSensorModel& sensor, const ContactClassifier& classifier) {
        std::vector<nb::object> kept;
        std::vector<ObjectTouches> all;
        for (const auto& [label, touches] : objects) {
          TouchViews views = views_of(touches);
          all.push_back({label, std::move(views.touches)});
          kept.push_back(std::move(views.kept));
        }
        const MapOptions options{.cell_mm = cell_mm, .sensor = sensor, .classifier = classifier};
        return run([&] { return estimate_prior(device, all, options); });
      },
      "device"_a, "objects"_a, nb::kw_only(), "cell_mm"_a = MapOptions{}.cell_mm,
      "sensor"_a = InverseSensorModel{}, "classifier"_a = ContactClassifier{},
      "p(m) as in the paper: occupied area over modelled area, pooled over all objects, which are\n"
      "touches by label.");
}

}  // namespace palpate::python
