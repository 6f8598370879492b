# Writes a C++ file with a function that returns the content of a text file: cmake -DFROM=FILE -DTO=FILE.cpp
# -DHEADER=report/viewer.h -DFUNCTION=viewer -P EmbedText.cmake. A raw string is compiled quickly.
file(READ "${FROM}" text)
string(FIND "${text}" ")covol\"" ends)
if(NOT ends EQUAL -1)
  message(FATAL_ERROR "${FROM}: holds )covol\", which ends the raw string")
endif()
file(WRITE "${TO}.new" "#include \"${HEADER}\"\n\nnamespace covol::detail {\n\nstd::string_view ${FUNCTION}() { return R\"covol(${text})covol\"; }\n\n}  // namespace covol::detail\n")
file(RENAME "${TO}.new" "${TO}")
