# Writes the SPIR-V file's 32-bit words as a C++ array.
file(READ ${SPIRV} hex HEX)
# The file is little-endian: bytes b0 b1 b2 b3 make the word 0xb3b2b1b0.
string(REGEX REPLACE "(..)(..)(..)(..)" "0x\\4\\3\\2\\1," words "${hex}")
file(WRITE ${HEADER} "#pragma once\n\n#include <cstdint>\n\nnamespace palpate::shaders {\n"
                     "inline constexpr std::uint32_t ${NAME}[] = {${words}};\n}\n")
