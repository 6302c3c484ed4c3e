#include "io/element_file.hpp"

#include <algorithm>
#include <fstream>
#include <string>

#include "io/input_file.hpp"
#include "model/number_text.hpp"

namespace palpate {

std::vector<glm::dvec2> read_elements(const std::filesystem::path& path) {
  require_readable(path);
  std::ifstream file(path);
  std::vector<glm::dvec2> elements;
  std::string line;
  for (int number = 1; std::getline(file, line); ++number) {
    line.resize(std::min(line.find('#'), line.size()));
    if (line.find_first_not_of(" \t\r\v\f") == std::string::npos) {
      continue;
    }
    const auto xy = two_numbers_of(line);
    if (!xy) {
      refuse(path, "line {} is not a position; write 'x y' in mm", number);
    }
    elements.emplace_back((*xy)[0], (*xy)[1]);
  }
  if (elements.empty()) {
    refuse(path, "holds no element; write a line 'x y' in mm for each");
  }
  return elements;
}

}  // namespace palpate
