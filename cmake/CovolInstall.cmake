# cmake --install: the program, the library, its headers, and what find_package(covol) needs.
if(COVOL_SENSITIVITY)
  install(CODE "message(FATAL_ERROR \"covol: a build with COVOL_SENSITIVITY is not for use\")")
endif()
include(CMakePackageConfigHelpers)

set(COVOL_CONFIG_DIR ${CMAKE_INSTALL_LIBDIR}/cmake/covol)
set(COVOL_IS_SHARED ${BUILD_SHARED_LIBS})

set_target_properties(covol PROPERTIES VERSION ${PROJECT_VERSION} SOVERSION ${PROJECT_VERSION_MAJOR}.${PROJECT_VERSION_MINOR})
install(TARGETS covol EXPORT covolTargets
  LIBRARY DESTINATION ${CMAKE_INSTALL_LIBDIR}
  ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR}
  FILE_SET HEADERS DESTINATION ${CMAKE_INSTALL_INCLUDEDIR})
install(EXPORT covolTargets NAMESPACE covol:: DESTINATION ${COVOL_CONFIG_DIR})

configure_package_config_file(${CMAKE_CURRENT_LIST_DIR}/covolConfig.cmake.in
  ${PROJECT_BINARY_DIR}/covolConfig.cmake INSTALL_DESTINATION ${COVOL_CONFIG_DIR})
write_basic_package_version_file(${PROJECT_BINARY_DIR}/covolConfigVersion.cmake COMPATIBILITY SameMinorVersion)
install(FILES
  ${PROJECT_BINARY_DIR}/covolConfig.cmake
  ${PROJECT_BINARY_DIR}/covolConfigVersion.cmake
  ${CMAKE_CURRENT_LIST_DIR}/CovolOpenVDB.cmake
  DESTINATION ${COVOL_CONFIG_DIR})
install(FILES ${PROJECT_SOURCE_DIR}/LICENSE DESTINATION ${CMAKE_INSTALL_DOCDIR})
