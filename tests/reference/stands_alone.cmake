# The reference is an oracle only as long as it shares no function with what it is the oracle of: it
# calls none of the product's, and none of its sources includes a header of Vulkan.

execute_process(COMMAND ${NM} --demangle --undefined-only ${LIBRARY}
                OUTPUT_VARIABLE called COMMAND_ERROR_IS_FATAL ANY)
string(REGEX MATCHALL " U [^\n]*" called "${called}")
if(NOT called MATCHES " U log1p")
  message(FATAL_ERROR "${NM} does not show what the reference calls")
endif()
list(FILTER called INCLUDE REGEX "palpate::| vk[A-Z]")
list(FILTER called EXCLUDE REGEX " U palpate::reference::")
if(called)
  message(FATAL_ERROR "the reference calls what it has to check: ${called}")
endif()

file(GLOB sources ${SOURCES}/*.cpp)
execute_process(COMMAND ${COMPILER} -std=c++20 -M -I${SOURCES}/.. -I${HEADERS} ${sources}
                OUTPUT_VARIABLE included COMMAND_ERROR_IS_FATAL ANY)
if(NOT included MATCHES "reference\\.hpp")
  message(FATAL_ERROR "${COMPILER} -M lists no headers")
endif()
string(REGEX MATCH "[^ ]*vulkan[^ ]*" vulkan "${included}")
if(vulkan)
  message(FATAL_ERROR "the reference includes ${vulkan}")
endif()
