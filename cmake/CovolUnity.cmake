# covol_unity(TARGET [PRECOMPILED HEADER...]): with COVOL_UNITY the sources of each folder are compiled as one, with
# these precompiled headers. Templates of OpenVDB and CLI11 are then instantiated once per folder instead of once per
# source. Names in unnamed namespaces must differ within a folder: tests/lint/unity_test.py. Sources with options of
# their own are compiled separately.
function(covol_unity target)
  cmake_parse_arguments(ARG "" "" PRECOMPILED ${ARGN})
  if(NOT COVOL_UNITY)
    return()
  endif()
  get_target_property(sources ${target} SOURCES)
  foreach(source ${sources})
    get_filename_component(folder ${source} DIRECTORY)
    string(MAKE_C_IDENTIFIER "${folder}" group)
    set_source_files_properties(${source} PROPERTIES UNITY_GROUP ${group})
  endforeach()
  set_target_properties(${target} PROPERTIES UNITY_BUILD ON UNITY_BUILD_MODE GROUP)
  target_compile_options(${target} PRIVATE -Wno-subobject-linkage)  # GCC would treat included sources as headers
  if(ARG_PRECOMPILED)
    target_precompile_headers(${target} PRIVATE ${ARG_PRECOMPILED})
  endif()
endfunction()
