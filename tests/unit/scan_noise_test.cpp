#include "covol/scan_noise.h"
#include <catch2/catch.hpp>
