#pragma once

/// Exports a declaration from the shared library; declarations without this macro are hidden.
#if defined(__GNUC__)
#define COVOL_API __attribute__((visibility("default")))
#else
#define COVOL_API
#endif
