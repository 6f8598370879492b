#pragma once

namespace covol::tool {

/// Commands with which to try the program for the first time, one per line, as shown in its help.
constexpr const char* kFirstSteps =
    "  covol demo               a sample image and its marks, in the browser\n"
    "  covol mark stack.tif     click marks on your own image there, and see the surface\n"
    "  covol segment stack.tif --points marks.csv -o cell.vdb --report cell.html    without clicks\n";

}  // namespace covol::tool
