// Learns a map from a program's own arrays: what a tactile array read, and where it was.
//   map_of_arrays MAP.h5 PICTURE.svg
#include <cmath>
#include <iostream>
#include <vector>

#include <palpate/palpate.hpp>

#include "drawings.hpp"

int main(int argc, char** argv) try {
  if (argc != 3) {
    std::cerr << "usage: map_of_arrays MAP.h5 PICTURE.svg\n";
    return 2;
  }
  // An array of 4 x 4 elements, 2 mm apart, about the origin of the sensor frame.
  const std::vector<glm::dvec2> elements_mm = palpate::grid_array(4, 4, 2.0);

  // The readings of a real array go here. Each touch of this one is of a disc of 6 mm radius that
  // lies at the origin of the robot frame, which becomes the object frame.
  std::vector<palpate::Pose> T_robot_sensor;   // [touch]
  std::vector<std::vector<double>> pressures;  // [touch][element], kPa
  for (double x = -8.0; x <= 8.0; x += 2.0) {
    for (double y = -8.0; y <= 8.0; y += 2.0) {
      T_robot_sensor.push_back({{x, y}, 0.1 * x});
      pressures.emplace_back();
      for (const glm::dvec2& element : elements_mm) {
        const glm::dvec2 p = T_robot_sensor.back() * element;
        pressures.back().push_back(std::hypot(p.x, p.y) < 6.0 ? 20.0 : 0.5);
      }
    }
  }

  palpate::Device device = palpate::Device::open();
  palpate::MapBuilder builder(device, {.cell_mm = 0.5});
  for (std::size_t i = 0; i < pressures.size(); ++i) {
    // A touch refers to the arrays and copies none of them.
    const palpate::Touch touch{T_robot_sensor[i], elements_mm, pressures[i]};
    builder.add({&touch, 1});
  }
  const palpate::OccupancyGrid map = builder.build("disc");
  palpate::write_map(argv[1], map);

  const palpate::Body body = palpate::body_of(map);  // the cells that are probably occupied
  std::cout << "disc: radius " << std::sqrt(2.0 * body.inertia_mm2) << " mm about "
            << body.centroid_mm.x << ", " << body.centroid_mm.y << " mm\n";

  Picture picture = picture_of(map);
  const glm::dvec2 disc = -map.origin_mm / map.cell_mm;
  picture.circle(disc.x, disc.y, 6.0 / map.cell_mm,
                 R"(fill="none" stroke="#000" stroke-width=".3")");
  picture.save(argv[2]);
} catch (const palpate::Error& error) {
  std::cerr << error.what() << "\n";
  return 1;
}
