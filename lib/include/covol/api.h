#pragma once

/// Exports a declaration from the shared library; everything else in it is hidden.
#if defined(__GNUC__)
#define COVOL_API __attribute__((visibility("default")))
#else
#define COVOL_API
#endif
