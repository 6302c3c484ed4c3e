#include <algorithm>
#include <utility>

#include "palpate/estimate.hpp"
#include "palpate/occupancy_grid.hpp"

namespace palpate {

OccupancyGrid mirror_image(const OccupancyGrid& map) {
  OccupancyGrid image = map;
  image.source.reset();  // its touches are of the side that was learned
  image.origin_mm.x = 0.0 - map.centre_mm(map.nx - 1, 0).x;
  for (std::vector<float>* cells : {&image.log_odds, &image.observations, &image.mean_level}) {
    for (auto row = cells->begin(); row != cells->end(); row += map.nx) {
      std::reverse(row, row + map.nx);
    }
  }
  return image;
}

void add_mirror_images(std::vector<Hypothesis>& hypotheses) {
  std::vector<Hypothesis> all;
  for (Hypothesis& hypothesis : hypotheses) {
    const bool mirror = hypothesis.map.mirror;
    all.push_back(std::move(hypothesis));
    if (mirror) {
      all.back().weight /= 2.0;
      Hypothesis image = all.back();
      image.map = mirror_image(image.map);
      if (image.layer) {
        image.layer = mirror_image(*image.layer);
      }
      image.mirrored = true;
      all.push_back(std::move(image));
    }
  }
  hypotheses = std::move(all);
}

}  // namespace palpate
