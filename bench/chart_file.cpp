#include "chart_file.hpp"

#include "atomic_file.hpp"

namespace palpate::bench {

std::array<std::string, 2> chart_files(const std::string& name) {
  return {name + ".png", name + ".svg"};
}

void write_chart(const Chart& chart, const std::filesystem::path& folder, const std::string& name) {
  const std::array<std::string, 2> names = chart_files(name);
  const auto write = [&](const std::string& file_name, PictureFormat format) {
    AtomicFile file(folder / file_name);
    file.write(draw_chart(chart, format).bytes);
    file.commit();
  };
  write(names[0], PictureFormat::png);
  write(names[1], PictureFormat::svg);
}

}  // namespace palpate::bench
