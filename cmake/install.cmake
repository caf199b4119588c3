# What `cmake --install` puts under a prefix: the tool, the shared library, its C header, the machine
# files, and how a stranger's project finds them (find_package and pkg-config).
if(NOT TARGET smoothpost)
  return()
endif()

include(GNUInstallDirs)
include(CMakePackageConfigHelpers)

set(SMOOTHPOST_CMAKE_DIR ${CMAKE_INSTALL_LIBDIR}/cmake/smoothpost)
set(SMOOTHPOST_MACHINES_DIR ${CMAKE_INSTALL_DATADIR}/smoothpost/machines)

# Visibility alone is not enough: templates of the standard library keep theirs.
target_link_options(smoothpost PRIVATE "LINKER:--version-script=${PROJECT_SOURCE_DIR}/cmake/smoothpost.map")
set_property(TARGET smoothpost APPEND PROPERTY LINK_DEPENDS ${PROJECT_SOURCE_DIR}/cmake/smoothpost.map)

# The soname changes with the ABI, which before 1.0 may change with each minor version.
set_target_properties(smoothpost PROPERTIES
  VERSION ${PROJECT_VERSION} SOVERSION ${PROJECT_VERSION_MAJOR}.${PROJECT_VERSION_MINOR})

install(TARGETS smoothpost EXPORT smoothpostTargets LIBRARY DESTINATION ${CMAKE_INSTALL_LIBDIR})
install(EXPORT smoothpostTargets NAMESPACE smoothpost:: DESTINATION ${SMOOTHPOST_CMAKE_DIR})
install(DIRECTORY ${PROJECT_SOURCE_DIR}/postproc/capi/include/smoothpost
  DESTINATION ${CMAKE_INSTALL_INCLUDEDIR} FILES_MATCHING PATTERN "*.h")

if(TARGET smoothpost_tool)
  # The tool finds the library beside it, wherever the prefix is moved.
  file(RELATIVE_PATH bin_to_lib ${CMAKE_INSTALL_FULL_BINDIR} ${CMAKE_INSTALL_FULL_LIBDIR})
  set_target_properties(smoothpost_tool PROPERTIES INSTALL_RPATH "$ORIGIN/${bin_to_lib}")
  install(TARGETS smoothpost_tool RUNTIME DESTINATION ${CMAKE_INSTALL_BINDIR})

  # Manual page and completions come from the tool's own table of options.
  set(documents "")
  foreach(kind man bash zsh fish)
    set(made ${PROJECT_BINARY_DIR}/documents/smoothpost.${kind})
    add_custom_command(OUTPUT ${made}
      COMMAND ${CMAKE_COMMAND} -E make_directory ${PROJECT_BINARY_DIR}/documents
      COMMAND smoothpost_tool --generate ${kind} > ${made}
      DEPENDS smoothpost_tool VERBATIM)
    list(APPEND documents ${made})
  endforeach()
  add_custom_target(smoothpost_documents ALL DEPENDS ${documents})
  set(made ${PROJECT_BINARY_DIR}/documents/smoothpost)
  install(FILES ${made}.man DESTINATION ${CMAKE_INSTALL_MANDIR}/man1 RENAME smoothpost.1)
  install(FILES ${made}.bash DESTINATION ${CMAKE_INSTALL_DATADIR}/bash-completion/completions RENAME smoothpost)
  install(FILES ${made}.zsh DESTINATION ${CMAKE_INSTALL_DATADIR}/zsh/vendor-completions RENAME _smoothpost)
  install(FILES ${made}.fish DESTINATION ${CMAKE_INSTALL_DATADIR}/fish/vendor_completions.d)
endif()

file(GLOB machine_files RELATIVE ${PROJECT_SOURCE_DIR}/machines CONFIGURE_DEPENDS
     ${PROJECT_SOURCE_DIR}/machines/*/machine.toml)
foreach(machine_file ${machine_files})
  get_filename_component(machine ${machine_file} DIRECTORY)
  install(DIRECTORY ${PROJECT_SOURCE_DIR}/machines/${machine} DESTINATION ${SMOOTHPOST_MACHINES_DIR})
endforeach()
# What a host loads: FreeCAD's addon, LinuxCNC's filter section.
set(SMOOTHPOST_HOSTS_DIR ${CMAKE_INSTALL_DATADIR}/smoothpost/hosts)
install(DIRECTORY ${PROJECT_SOURCE_DIR}/postproc/hosts/ DESTINATION ${SMOOTHPOST_HOSTS_DIR}
  PATTERN __pycache__ EXCLUDE)
install(FILES ${PROJECT_SOURCE_DIR}/LICENSE DESTINATION ${SMOOTHPOST_HOSTS_DIR}/freecad)
install(FILES ${PROJECT_SOURCE_DIR}/LICENSE ${PROJECT_SOURCE_DIR}/docs/licences.md
  DESTINATION ${CMAKE_INSTALL_DOCDIR})

configure_package_config_file(${PROJECT_SOURCE_DIR}/cmake/smoothpostConfig.cmake.in
  ${PROJECT_BINARY_DIR}/smoothpostConfig.cmake
  INSTALL_DESTINATION ${SMOOTHPOST_CMAKE_DIR} PATH_VARS SMOOTHPOST_MACHINES_DIR)
write_basic_package_version_file(${PROJECT_BINARY_DIR}/smoothpostConfigVersion.cmake
  VERSION ${PROJECT_VERSION} COMPATIBILITY SameMinorVersion)
install(FILES ${PROJECT_BINARY_DIR}/smoothpostConfig.cmake ${PROJECT_BINARY_DIR}/smoothpostConfigVersion.cmake
  DESTINATION ${SMOOTHPOST_CMAKE_DIR})

# ${pcfiledir} keeps the .pc file true when the prefix is moved.
file(RELATIVE_PATH pc_to_prefix ${CMAKE_INSTALL_FULL_LIBDIR}/pkgconfig ${CMAKE_INSTALL_PREFIX})
configure_file(${PROJECT_SOURCE_DIR}/cmake/smoothpost.pc.in ${PROJECT_BINARY_DIR}/smoothpost.pc @ONLY)
install(FILES ${PROJECT_BINARY_DIR}/smoothpost.pc DESTINATION ${CMAKE_INSTALL_LIBDIR}/pkgconfig)
