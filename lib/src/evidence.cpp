#include "covol/evidence.h"
