# Removes the RPATH from programs and libraries in the package. Files below /usr find their libraries without it, and Debian does
# not allow it.
file(GLOB_RECURSE files ${CPACK_TEMPORARY_DIRECTORY}/*)
foreach(file ${files})
  if(IS_SYMLINK ${file} OR NOT file MATCHES "/(covol|covol-reader|[^/]*\\.so[^/]*)$")
    continue()
  endif()
  file(READ ${file} magic LIMIT 4 HEX)
  if(magic STREQUAL 7f454c46)
    file(RPATH_REMOVE FILE ${file})
  endif()
endforeach()
