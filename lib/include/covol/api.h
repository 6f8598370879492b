#pragma once

/// Marks what the shared library gives to programs; all else in it is hidden.
#if defined(__GNUC__)
#define COVOL_API __attribute__((visibility("default")))
#else
#define COVOL_API
#endif
