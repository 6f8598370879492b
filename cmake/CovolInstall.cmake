# cmake --install: the program, the library, its headers, and the files for find_package(covol).
if(COVOL_SENSITIVITY)
  install(CODE "message(FATAL_ERROR \"covol: a build with COVOL_SENSITIVITY is not for use\")")
endif()
include(CMakePackageConfigHelpers)

set(COVOL_CONFIG_DIR ${CMAKE_INSTALL_LIBDIR}/cmake/covol)
set(COVOL_IS_SHARED ${BUILD_SHARED_LIBS})

set_target_properties(covol PROPERTIES VERSION ${PROJECT_VERSION} SOVERSION ${PROJECT_VERSION_MAJOR}.${PROJECT_VERSION_MINOR})
install(TARGETS covol EXPORT covolTargets
  LIBRARY DESTINATION ${CMAKE_INSTALL_LIBDIR} COMPONENT program NAMELINK_COMPONENT development
  ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR} COMPONENT development
  FILE_SET HEADERS DESTINATION ${CMAKE_INSTALL_INCLUDEDIR} COMPONENT development)
if(COVOL_IO)
  install(TARGETS covol_reader RUNTIME DESTINATION ${CMAKE_INSTALL_LIBDIR}/covol-${PROJECT_VERSION} COMPONENT program)
endif()
if(COVOL_IO AND BUILD_SHARED_LIBS)
  install(TARGETS covol_itk covol_gdcm covol_hdf5
    LIBRARY DESTINATION ${CMAKE_INSTALL_LIBDIR}/covol-${PROJECT_VERSION} COMPONENT program)
endif()
install(EXPORT covolTargets NAMESPACE covol:: DESTINATION ${COVOL_CONFIG_DIR} COMPONENT development)

configure_package_config_file(${CMAKE_CURRENT_LIST_DIR}/covolConfig.cmake.in
  ${PROJECT_BINARY_DIR}/covolConfig.cmake INSTALL_DESTINATION ${COVOL_CONFIG_DIR})
write_basic_package_version_file(${PROJECT_BINARY_DIR}/covolConfigVersion.cmake COMPATIBILITY SameMinorVersion)
install(FILES
  ${PROJECT_BINARY_DIR}/covolConfig.cmake
  ${PROJECT_BINARY_DIR}/covolConfigVersion.cmake
  ${CMAKE_CURRENT_LIST_DIR}/CovolOpenVDB.cmake
  DESTINATION ${COVOL_CONFIG_DIR} COMPONENT development)
if(BUILD_SHARED_LIBS)
  # Its paths are relative to its own location, so that a package or a prefix can be moved.
  file(RELATIVE_PATH COVOL_PC_TO_PREFIX /p/${CMAKE_INSTALL_LIBDIR}/pkgconfig /p)
  configure_file(${PROJECT_SOURCE_DIR}/tools/packaging/covol.pc.in ${PROJECT_BINARY_DIR}/covol.pc @ONLY)
  install(FILES ${PROJECT_BINARY_DIR}/covol.pc DESTINATION ${CMAKE_INSTALL_LIBDIR}/pkgconfig COMPONENT development)
endif()
# A Debian package has the licence in its copyright file instead.
install(FILES ${PROJECT_SOURCE_DIR}/LICENSE DESTINATION ${CMAKE_INSTALL_DOCDIR} COMPONENT licence)
if(PROJECT_IS_TOP_LEVEL AND BUILD_SHARED_LIBS AND COVOL_BUILD_TOOLS)
  include(CovolPackages)
endif()
