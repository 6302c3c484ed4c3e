#include "io/input_file.hpp"
#include "io/svg_drawing.hpp"

namespace palpate {

GreyPicture draw_svg(const std::filesystem::path& path, const DrawingOptions& /*options*/) {
  refuse(path, "this build reads no SVG; save the drawing as PNG, and give `mm-per-pixel`");
}

}  // namespace palpate
