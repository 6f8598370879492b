#include "covol/scan_solid.h"
#include <catch2/catch.hpp>
