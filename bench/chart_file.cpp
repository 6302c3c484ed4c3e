#include "chart_file.hpp"

#include "atomic_file.hpp"

namespace palpate::bench {

void write_chart(const Chart& chart, const std::filesystem::path& folder, const std::string& name) {
  const auto write = [&](const char* extension, PictureFormat format) {
    AtomicFile file(folder / (name + extension));
    file.write(draw_chart(chart, format).bytes);
    file.commit();
  };
  write(".png", PictureFormat::png);
  write(".svg", PictureFormat::svg);
}

}  // namespace palpate::bench
