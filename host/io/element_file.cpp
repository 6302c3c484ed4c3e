#include "element_file.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <fstream>
#include <sstream>
#include <string>

#include "input_file.hpp"

namespace palpate {

std::vector<glm::dvec2> read_elements(const std::filesystem::path& path) {
  require_readable(path);
  std::ifstream file(path);
  std::vector<glm::dvec2> elements;
  std::string line;
  for (int number = 1; std::getline(file, line); ++number) {
    line.resize(std::min(line.find('#'), line.size()));
    std::istringstream fields(line);
    fields >> std::ws;
    if (fields.eof()) {
      continue;
    }
    glm::dvec2 element;
    if (!(fields >> element.x >> element.y) || !(fields >> std::ws).eof()) {
      refuse(path, fmt::format("line {} is not a position; write 'x y' in mm", number));
    }
    elements.push_back(element);
  }
  if (elements.empty()) {
    refuse(path, "holds no element; write a line 'x y' in mm for each");
  }
  return elements;
}

}  // namespace palpate
