# Installs the build tree into a scratch prefix, and uses Palpate only from there. CTest runs this.
cmake_minimum_required(VERSION 3.25)

function(run)
  execute_process(COMMAND ${ARGV} OUTPUT_VARIABLE output ERROR_VARIABLE output
                  RESULT_VARIABLE status)
  list(JOIN ARGV " " command)
  message(STATUS "${command}\n${output}")
  if(NOT status EQUAL 0)
    message(FATAL_ERROR "failed with ${status}: ${command}")
  endif()
  set(output "${output}" PARENT_SCOPE)
endfunction()

set(prefix ${SCRATCH_DIR}/prefix)
file(REMOVE_RECURSE ${SCRATCH_DIR})
run(${CMAKE_COMMAND} --install ${BUILD_DIR} --prefix ${prefix})

# The program must find its library relative to itself after the prefix was moved.
file(RENAME ${prefix} ${prefix}.moved)
set(prefix ${prefix}.moved)
run(${prefix}/bin/palpate --version)
if(NOT output STREQUAL "${VERSION}\n")
  message(FATAL_ERROR "palpate --version printed '${output}', not ${VERSION}")
endif()

# A user needs no headers of HDF5 or libusb, and of Vulkan only in the one made for them.
file(GLOB_RECURSE headers ${prefix}/include/*.hpp)
if(NOT headers)
  message(FATAL_ERROR "no header was installed")
endif()
foreach(header IN LISTS headers)
  file(STRINGS ${header} includes REGEX "#[ \t]*include.*(vulkan|hdf5|H5|libusb)")
  if(includes AND NOT header MATCHES "/vulkan_device.hpp$")
    message(FATAL_ERROR "${header} is public, but says ${includes}")
  endif()
endforeach()

# No header, program or example raises a warning.
string(APPEND FLAGS " -Wall -Wextra -Wconversion -Werror")
run(${COMPILER} -std=c++20 -Wconversion -Wsign-conversion -Werror -I${prefix}/include
    -include palpate/palpate.hpp -include palpate/driver.hpp -x c++ -fsyntax-only /dev/null)

# Sanitizers work in the library only if the program is built with them, which takes a third of the time
# where nothing is optimised.
if(SANITIZE)
  string(APPEND FLAGS " -fsanitize=${SANITIZE}")
  set(BUILD_TYPE "")
endif()
function(build source folder)
  run(${CMAKE_COMMAND} -S ${source} -B ${folder} -G ${GENERATOR}
      -DCMAKE_PREFIX_PATH=${prefix} -DCMAKE_CXX_COMPILER=${COMPILER}
      -DCMAKE_BUILD_TYPE=${BUILD_TYPE} "-DCMAKE_CXX_FLAGS=${FLAGS}")
  run(${CMAKE_COMMAND} --build ${folder})
endfunction()
build(${PROJECT_DIR} ${SCRATCH_DIR}/build)
# Programs of the archives find the data below their own prefix, so they are installed there.
foreach(program IN ITEMS consumer board_reader)
  run(${SCRATCH_DIR}/build/${program})
  file(COPY ${SCRATCH_DIR}/build/${program}_static DESTINATION ${prefix}/bin)
  run(${CMAKE_COMMAND} -E env PATH=${prefix}/bin ${program}_static)
endforeach()

# By pkg-config, with the shared library and with the archive.
set(ENV{PKG_CONFIG_PATH} ${prefix}/${LIBDIR}/pkgconfig)
separate_arguments(flags UNIX_COMMAND "-std=c++20 ${FLAGS}")
foreach(package IN ITEMS palpate palpate-driver)
  run(pkg-config --modversion ${package})
  if(NOT output STREQUAL "${VERSION}\n")
    message(FATAL_ERROR "${package}.pc has version ${output}")
  endif()
endforeach()
run(pkg-config --cflags --libs palpate-driver)
separate_arguments(shared UNIX_COMMAND "${output}")
run(${COMPILER} ${flags} ${PROJECT_DIR}/board_reader.cpp -o ${SCRATCH_DIR}/by_pkg_config ${shared}
    -Wl,-rpath,${prefix}/${LIBDIR})
run(${SCRATCH_DIR}/by_pkg_config)
run(pkg-config --static --libs palpate)
string(REPLACE "-lpalpate" "-l:libpalpate.a" output "${output}")
separate_arguments(static UNIX_COMMAND "${output}")
file(GLOB_RECURSE main ${SCRATCH_DIR}/build/main.cpp.o)
run(${COMPILER} ${flags} ${main} -o ${SCRATCH_DIR}/by_pkg_config_static ${static})
run(${SCRATCH_DIR}/by_pkg_config_static)

# What is linked and what not: the core does without libusb, the driver without the core's HDF5, and
# programs of the archives without the shared libraries. Nothing links Vulkan, which is loaded at run
# time.
foreach(program IN ITEMS build/consumer=libusb build/consumer=libvulkan
                         build/consumer_static=libvulkan prefix.moved/bin/palpate=libvulkan
                         build/board_reader=libhdf5
                         build/consumer_static=libpalpate build/board_reader_static=libpalpate
                         by_pkg_config_static=libpalpate)
  string(REGEX MATCH "(.*)=(.*)" program ${program})
  file(GET_RUNTIME_DEPENDENCIES EXECUTABLES ${SCRATCH_DIR}/${CMAKE_MATCH_1}
       RESOLVED_DEPENDENCIES_VAR libraries UNRESOLVED_DEPENDENCIES_VAR unresolved)
  string(REGEX MATCH "(.*)=(.*)" program ${program})
  if("${libraries}" MATCHES "/${CMAKE_MATCH_2}[-.]" OR NOT libraries)
    message(FATAL_ERROR "${program} links more than it needs:\n${libraries}")
  endif()
endforeach()

# The data files are found from the library and from a program that has the archive.
foreach(file IN ITEMS share/palpate/70-palpate.rules share/palpate/profiles/tsf85.yaml
                      lib/udev/rules.d/70-palpate.rules
                      share/bash-completion/completions/palpate)
  if(NOT EXISTS ${prefix}/${file})
    message(FATAL_ERROR "${file} was not installed")
  endif()
endforeach()

# The examples, on files that the command makes.
build(${EXAMPLES_DIR} ${SCRATCH_DIR}/examples)
set(examples ${SCRATCH_DIR}/examples)
foreach(letter IN ITEMS A E)
  run(${prefix}/bin/palpate simulate ${letter} -o ${examples}/${letter}.h5)
endforeach()
run(${prefix}/bin/palpate map ${examples}/A.h5 ${examples}/E.h5 -o ${examples}/maps/)
set(maps ${examples}/maps/A.map.h5 ${examples}/maps/E.map.h5)
run(${prefix}/bin/palpate simulate E -o ${examples}/unknown.h5 --object-pose 4,-3,50 --touches 9
    --seed 2)
# Expects the picture that stands next to the example.
function(expect_picture made example)
  run(${PYTHON} ${TESTS_DIR}/same_picture.py ${made} ${EXAMPLES_DIR}/${example}.svg)
endfunction()
run(${examples}/recognise_recordings ${examples}/unknown.h5 --maps ${maps})
if(NOT output MATCHES "unknown.h5: E with probability (1|0.99)")
  message(FATAL_ERROR "recognise_recordings took the E for ${output}")
endif()
expect_picture(${examples}/unknown.h5.svg recognise_recordings)
run(${CMAKE_COMMAND} -E chdir ${examples}
    ${examples}/live_stream simulate:E,speed=max,object=4:-3:50,touches=9,rate=200 ${maps})
if(NOT output MATCHES "E with probability (1|0.99)[^\n]*\n$")
  message(FATAL_ERROR "live_stream took the E for ${output}")
endif()
expect_picture(${examples}/live_stream.svg live_stream)
run(${examples}/map_of_arrays ${examples}/disc.map.h5 ${examples}/disc.svg)
if(NOT output MATCHES "disc: radius [5-7](\\.[0-9]+)? mm")
  message(FATAL_ERROR "map_of_arrays mapped a disc of 6 mm radius as ${output}")
endif()
expect_picture(${examples}/disc.svg map_of_arrays)
run(${prefix}/bin/palpate info ${examples}/disc.map.h5)
