# Writes palpate(1) and a page for every command, palpate-COMMAND(1), from what --help prints.
cmake_minimum_required(VERSION 3.25)

function(page name summary)
  string(REPLACE " " "-" file "${name}")
  execute_process(
    COMMAND ${HELP2MAN} --no-info --version-string=${VERSION} --name=${summary} "${PALPATE}${ARGN}"
    OUTPUT_VARIABLE text COMMAND_ERROR_IS_FATAL ANY)
  # help2man takes the program's name for the page's.
  string(REGEX REPLACE "\n\\.TH [^ ]+ " "\n.TH ${file} " text "${text}")
  string(REGEX REPLACE "\n${name} (.. )" "\n${file} \\1" text "${text}")
  file(WRITE ${FOLDER}/${file}.1 "${text}")
  execute_process(COMMAND ${GZIP} -9nf ${FOLDER}/${file}.1 COMMAND_ERROR_IS_FATAL ANY)
endfunction()

file(REMOVE_RECURSE ${FOLDER})
execute_process(COMMAND ${PALPATE} --help OUTPUT_VARIABLE help COMMAND_ERROR_IS_FATAL ANY)
string(REGEX REPLACE ".*\nSubcommands:\n" "" commands "${help}")
string(REPLACE ";" "," commands "${commands}")
string(REGEX MATCHALL "[^\n]+" commands "${commands}")
if(NOT commands)
  message(FATAL_ERROR "${PALPATE} --help lists no commands")
endif()
page("palpate" "recognise objects by touch and find their poses")
foreach(line IN LISTS commands)
  string(REGEX MATCH "^ +([a-z]+) +(.*)$" line "${line}")
  set(command ${CMAKE_MATCH_1})
  # The first sentence of the command's description.
  string(REGEX REPLACE "[.,;:(].*" "" summary "${CMAKE_MATCH_2}")
  string(STRIP "${summary}" summary)
  page("palpate ${command}" "${summary}" " ${command}")
endforeach()
