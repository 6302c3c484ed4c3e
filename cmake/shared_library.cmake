# Adds <archive>_shared, the shared library of a static one, as palpate::<name>, made of the same
# objects, which follow as generator expressions. It exports what PALPATE_API marks. The version script hides the instances of other libraries' templates, whose
# visibility PALPATE_API does not govern, and refuses programs of another minor version at load time
# (docs/embedding.md).
function(palpate_add_shared_library archive name)
  set(library ${archive}_shared)
  set(script ${CMAKE_CURRENT_BINARY_DIR}/${archive}.map)
  file(CONFIGURE OUTPUT ${script} @ONLY CONTENT "\
PALPATE_@PROJECT_VERSION_MAJOR@.@PROJECT_VERSION_MINOR@ {
  global: extern \"C++\" { palpate::*; vtable?for?palpate::*; typeinfo?for?palpate::*;
                         typeinfo?name?for?palpate::*; };
  local: *;
};
")
  add_library(${library} SHARED ${ARGN})
  add_library(palpate::${name} ALIAS ${library})
  get_target_property(output_name ${archive} OUTPUT_NAME)
  set_target_properties(${library} PROPERTIES
    LINKER_LANGUAGE CXX
    OUTPUT_NAME ${output_name}
    EXPORT_NAME ${name}
    VERSION ${PROJECT_VERSION}
    SOVERSION ${PROJECT_VERSION_MAJOR}
    LINK_DEPENDS ${script})
  target_compile_features(${library} PUBLIC cxx_std_20)
  get_target_property(folders ${archive} INTERFACE_INCLUDE_DIRECTORIES)
  target_include_directories(${library} INTERFACE ${folders})
  get_target_property(libraries ${archive} LINK_LIBRARIES)
  target_link_libraries(${library} PUBLIC glm::glm PRIVATE ${libraries})
  target_link_options(${library} PRIVATE -Wl,--version-script=${script} -Wl,--as-needed)
endfunction()

# Installs an archive and its shared library, exported as <package>-targets and
# <package>-static-targets, and the pkg-config file <package>.pc, which names the libraries of the
# packages `requires_private` to whoever links the archive. Requires.private would have pkg-config ask
# for these packages also where only the shared library is linked.
function(palpate_install_library archive package description requires_private)
  set(folder ${CMAKE_INSTALL_LIBDIR}/cmake/palpate)
  get_target_property(component ${archive}_shared EXPORT_NAME)
  install(TARGETS ${archive}_shared EXPORT ${package}-targets
          LIBRARY COMPONENT ${component} NAMELINK_COMPONENT development)
  install(TARGETS ${archive} EXPORT ${package}-static-targets ARCHIVE COMPONENT development)
  foreach(export IN ITEMS ${package} ${package}-static)
    install(EXPORT ${export}-targets NAMESPACE palpate:: DESTINATION ${folder}
            COMPONENT development)
  endforeach()
  get_target_property(name ${archive} OUTPUT_NAME)
  # Relative, so that a moved installation works.
  file(RELATIVE_PATH prefix_from_pkgconfig /prefix/${CMAKE_INSTALL_LIBDIR}/pkgconfig /prefix)
  separate_arguments(private UNIX_COMMAND "${requires_private}")
  execute_process(COMMAND ${PKG_CONFIG_EXECUTABLE} --libs ${private} OUTPUT_VARIABLE libs_private
                  OUTPUT_STRIP_TRAILING_WHITESPACE COMMAND_ERROR_IS_FATAL ANY)
  configure_file(${PROJECT_SOURCE_DIR}/cmake/palpate.pc.in
                 ${CMAKE_CURRENT_BINARY_DIR}/${name}.pc @ONLY)
  install(FILES ${CMAKE_CURRENT_BINARY_DIR}/${name}.pc
          DESTINATION ${CMAKE_INSTALL_LIBDIR}/pkgconfig COMPONENT development)
endfunction()
