# covol_unity(TARGET [PRECOMPILED HEADER...]): with COVOL_UNITY the sources of each folder are compiled as one, behind these
# headers. Templates of OpenVDB and CLI11 are then instantiated once for a folder, not for each source. Names in unnamed
# namespaces must differ within a folder: tests/lint/unity_test.py. Sources with options of their own stay alone.
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
  target_compile_options(${target} PRIVATE -Wno-subobject-linkage)  # it takes what is included for headers
  if(ARG_PRECOMPILED)
    target_precompile_headers(${target} PRIVATE ${ARG_PRECOMPILED})
  endif()
endfunction()
