# Writes the page's files FILES, separated by commas, as a table of C++ to HEADER.
string(REPLACE "," ";" files "${FILES}")
set(entries "")
foreach(file IN LISTS files)
  cmake_path(GET file FILENAME name)
  cmake_path(GET file EXTENSION LAST_ONLY extension)
  set(path "/${name}")
  if(name STREQUAL "index.html")
    set(path "/")
  endif()
  string(REPLACE ".js" ".javascript" extension "${extension}")
  string(REPLACE "." "text/" type "${extension}")
  file(READ ${file} text)
  string(APPEND entries "    {\"${path}\", \"${type}; charset=utf-8\", R\"~~~(${text})~~~\"},\n")
endforeach()
file(WRITE ${HEADER} "#pragma once\n\n#include <string_view>\n\nnamespace palpate::cli {\n
struct SiteFile {
  const char* path;
  const char* type;
  std::string_view bytes;
};
inline constexpr SiteFile site[] = {\n${entries}};\n\n}  // namespace palpate::cli\n")
