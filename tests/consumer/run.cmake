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

# A user needs no headers of Vulkan, HDF5 or libusb.
file(GLOB_RECURSE headers ${prefix}/include/*.hpp)
if(NOT headers)
  message(FATAL_ERROR "no header was installed in ${prefix}/include")
endif()
foreach(header IN LISTS headers)
  file(STRINGS ${header} includes REGEX "#[ \t]*include.*(vulkan|hdf5|H5|libusb)")
  if(includes)
    message(FATAL_ERROR "${header} is public, but includes another library: ${includes}")
  endif()
endforeach()

# Sanitizers work in the library only if the program is built with them.
if(SANITIZE)
  string(APPEND FLAGS " -fsanitize=${SANITIZE}")
endif()
run(${CMAKE_COMMAND} -S ${PROJECT_DIR} -B ${SCRATCH_DIR}/build -G ${GENERATOR}
    -DCMAKE_PREFIX_PATH=${prefix} -DCMAKE_CXX_COMPILER=${COMPILER}
    -DCMAKE_BUILD_TYPE=${BUILD_TYPE} "-DCMAKE_CXX_FLAGS=${FLAGS}")
run(${CMAKE_COMMAND} --build ${SCRATCH_DIR}/build)
run(${SCRATCH_DIR}/build/consumer)
run(${SCRATCH_DIR}/build/board_reader)

# The core must not load libusb, nor the driver Vulkan.
foreach(program IN ITEMS consumer board_reader)
  file(GET_RUNTIME_DEPENDENCIES EXECUTABLES ${SCRATCH_DIR}/build/${program}
       RESOLVED_DEPENDENCIES_VAR ${program}_libraries UNRESOLVED_DEPENDENCIES_VAR unresolved)
endforeach()
if(consumer_libraries MATCHES "libusb" OR board_reader_libraries MATCHES "libvulkan")
  message(FATAL_ERROR "the core links libusb, or the driver Vulkan:\n${consumer_libraries}\n${board_reader_libraries}")
endif()
foreach(file IN ITEMS 70-palpate.rules profiles/tsf85.yaml)
  if(NOT EXISTS ${prefix}/share/palpate/${file})
    message(FATAL_ERROR "share/palpate/${file} was not installed")
  endif()
endforeach()
