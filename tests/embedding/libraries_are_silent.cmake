# No file of the libraries prints: what they have to say is a result, an exception or a message for
# set_log().
cmake_minimum_required(VERSION 3.25)
set(printing "std(out|err)|std::c(out|err|log)|fmt::print|(^|[^a-z_])(v?printf|puts|putchar|perror|psignal)\\(")

file(GLOB_RECURSE files ${SOURCES}/host/*.cpp ${SOURCES}/host/*.hpp ${SOURCES}/driver/*.cpp
     ${SOURCES}/driver/*.hpp)
set(library_files ${files})
list(FILTER library_files EXCLUDE REGEX "/host/cli/")
set(checked 0)
foreach(file IN LISTS library_files)
  math(EXPR checked "${checked} + 1")
  file(STRINGS ${file} lines REGEX "${printing}")
  list(FILTER lines EXCLUDE REGEX "^ *///?")
  if(lines)
    message(SEND_ERROR "${file} prints: ${lines}")
  endif()
endforeach()

# The commands do print: the expression finds it.
set(found 0)
list(FILTER files INCLUDE REGEX "/host/cli/")
foreach(file IN LISTS files)
  file(STRINGS ${file} lines REGEX "${printing}")
  if(lines)
    math(EXPR found "${found} + 1")
  endif()
endforeach()
if(checked LESS 200 OR found LESS 10)
  message(FATAL_ERROR "checked ${checked} files; ${found} of the commands' print")
endif()
