#pragma once

namespace palpate {

/// Has pictures drawn with the fonts that lie beside the program, in ../share/palpate/fonts, as in
/// a Python wheel: the machine may have neither fonts nor a configuration of fontconfig. Without
/// such a folder, and where FONTCONFIG_FILE is set in the environment, fontconfig finds the font.
void use_own_font();

}  // namespace palpate
