# cpack -G DEB: covol (program and library), libcovol-dev, python3-covol.
set(COVOL_MAINTAINER "covol developers <covol@packages.example.org>" CACHE STRING "Maintainer in the packages")
set(COVOL_PACKAGING ${PROJECT_SOURCE_DIR}/tools/packaging)

configure_file(${COVOL_PACKAGING}/changelog.in ${PROJECT_BINARY_DIR}/packages/changelog @ONLY)
find_program(COVOL_GZIP gzip)
if(NOT COVOL_GZIP)
  return()
endif()
execute_process(COMMAND ${COVOL_GZIP} -9nfk ${PROJECT_BINARY_DIR}/packages/changelog)

set(COVOL_DEB_program covol)
set(COVOL_DEB_development libcovol-dev)
set(COVOL_DEB_python python3-covol)
set(COVOL_DEB_COMPONENTS program development)
if(COVOL_PYTHON)
  list(APPEND COVOL_DEB_COMPONENTS python)
endif()
foreach(component ${COVOL_DEB_COMPONENTS})
  string(TOUPPER ${component} upper)
  set(doc share/doc/${COVOL_DEB_${component}})
  install(FILES ${COVOL_PACKAGING}/copyright.in RENAME copyright DESTINATION ${doc} COMPONENT ${component} EXCLUDE_FROM_ALL)
  install(FILES ${PROJECT_BINARY_DIR}/packages/changelog.gz DESTINATION ${doc} COMPONENT ${component} EXCLUDE_FROM_ALL)
  set(CPACK_DEBIAN_${upper}_PACKAGE_NAME ${COVOL_DEB_${component}})
  set(CPACK_DEBIAN_${upper}_FILE_NAME DEB-DEFAULT)
endforeach()

# The contents of all packages are built first: a build of the program does not include manual pages and the module.
add_custom_target(covol_packed)
add_dependencies(covol_packed covol covol_tool covol_made)
if(COVOL_PYTHON)
  add_dependencies(covol_packed covol_python)
endif()
set(CPACK_INSTALL_COMMANDS "${CMAKE_COMMAND} --build ${PROJECT_BINARY_DIR} --target covol_packed")

set(CPACK_GENERATOR DEB)
set(CPACK_COMPONENTS_ALL ${COVOL_DEB_COMPONENTS})
set(CPACK_DEB_COMPONENT_INSTALL ON)
set(CPACK_PACKAGING_INSTALL_PREFIX /usr)
set(CPACK_STRIP_FILES ON)
set(CPACK_INSTALL_DEFAULT_DIRECTORY_PERMISSIONS
  OWNER_READ OWNER_WRITE OWNER_EXECUTE GROUP_READ GROUP_EXECUTE WORLD_READ WORLD_EXECUTE)
set(CPACK_PRE_BUILD_SCRIPTS ${COVOL_PACKAGING}/strip_rpath.cmake)
set(CPACK_PACKAGE_VERSION ${PROJECT_VERSION})
set(CPACK_PACKAGE_CONTACT ${COVOL_MAINTAINER})
set(CPACK_DEBIAN_PACKAGE_CONTROL_STRICT_PERMISSION ON)
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS ON)
set(CPACK_DEBIAN_PACKAGE_GENERATE_SHLIBS ON)
set(CPACK_DEBIAN_PACKAGE_GENERATE_SHLIBS_POLICY "=")
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS_PRIVATE_DIRS ${PROJECT_BINARY_DIR}/lib)

set(CPACK_DEBIAN_PROGRAM_PACKAGE_SECTION science)
set(CPACK_DEBIAN_PROGRAM_DESCRIPTION "surfaces of structures in 3D images and of point clouds
covol finds the surface of a structure in a 3D image with the help of a few
marked points, and the surface behind a point cloud without normals, on
sparse OpenVDB level sets. It writes level sets, meshes and label images.")
set(CPACK_DEBIAN_PROGRAM_PACKAGE_CONTROL_EXTRA ${COVOL_PACKAGING}/triggers)

set(CPACK_DEBIAN_DEVELOPMENT_PACKAGE_SECTION libdevel)
set(CPACK_DEBIAN_DEVELOPMENT_PACKAGE_SHLIBDEPS OFF)
set(CPACK_DEBIAN_DEVELOPMENT_PACKAGE_DEPENDS "covol (= ${PROJECT_VERSION}), libopenvdb-dev, libtbb-dev, libimath-dev, libboost-dev")
set(CPACK_DEBIAN_DEVELOPMENT_DESCRIPTION "level-set segmentation library covol, development files
Headers of libcovol, and what CMake and pkg-config need to find it. covol
finds surfaces in 3D images and of point clouds on sparse level sets.")

if(COVOL_PYTHON)
  string(REGEX MATCH "^([0-9]+)\\.([0-9]+)" COVOL_PYTHON_ABI "${PYTHON_VERSION_STRING}")
  math(EXPR next "${CMAKE_MATCH_2} + 1")
  set(CPACK_DEBIAN_PYTHON_PACKAGE_SECTION python)
  set(CPACK_DEBIAN_PYTHON_PACKAGE_DEPENDS
    "covol (= ${PROJECT_VERSION}), python3 (>= ${COVOL_PYTHON_ABI}~), python3 (<< ${CMAKE_MATCH_1}.${next}), python3-numpy")
  set(CPACK_DEBIAN_PYTHON_DESCRIPTION "level-set segmentation of 3D images for Python
The module covol takes images and marks as arrays of NumPy and gives back
masks, meshes and level sets. covol finds surfaces in 3D images and of point
clouds with the help of a few marks.")
endif()
include(CPack)
