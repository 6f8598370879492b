// covol-reader: libcovol starts it to read files that may crash the libraries that read them.
#include "io/reader/serve.h"

int main(int count, char** arguments) { return covol::serve_reader(count, arguments); }
