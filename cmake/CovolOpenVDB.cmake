# Defines OpenVDB::openvdb. Debian's FindOpenVDB.cmake requires boost-iostreams, sets BUILD_SHARED_LIBS in the caller's
# scope and shadows TBBConfig.cmake, and is therefore replaced by this file, which covolConfig.cmake uses, too.
if(NOT TARGET OpenVDB::openvdb)
  find_package(TBB CONFIG REQUIRED)
  find_package(Imath CONFIG REQUIRED)
  find_path(OpenVDB_INCLUDE_DIR openvdb/version.h)
  find_library(OpenVDB_LIBRARY openvdb)
  if(NOT OpenVDB_INCLUDE_DIR OR NOT OpenVDB_LIBRARY)
    message(FATAL_ERROR "OpenVDB not found: install libopenvdb-dev, or set OpenVDB_INCLUDE_DIR and OpenVDB_LIBRARY")
  endif()
  add_library(OpenVDB::openvdb UNKNOWN IMPORTED)
  set_target_properties(OpenVDB::openvdb PROPERTIES
    IMPORTED_LOCATION "${OpenVDB_LIBRARY}"
    INTERFACE_INCLUDE_DIRECTORIES "${OpenVDB_INCLUDE_DIR}"
    INTERFACE_LINK_LIBRARIES "TBB::tbb;Imath::Imath")
endif()
