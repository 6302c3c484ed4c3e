#include "model/bounding_box.hpp"

namespace palpate {

BoundingBox occupied_box(const OccupancyGrid& map) {
  BoundingBox box;
  for (int j = 0; j < map.ny; ++j) {
    for (int i = 0; i < map.nx; ++i) {
      if (map.at(i, j) > 0.0F) {
        box.take_in(map.centre_mm(i, j));
      }
    }
  }
  if (box.empty()) {
    box.take_in(map.centre_mm(0, 0));
    box.take_in(map.centre_mm(map.nx - 1, map.ny - 1));
  }
  box.lower -= map.cell_mm / 2.0;
  box.upper += map.cell_mm / 2.0;
  return box;
}

}  // namespace palpate
