#pragma once
#include <pybind11/pybind11.h>

#include <cstdint>
#include <functional>

#include "covol/run.h"

namespace covol::python {

namespace py = pybind11;

/// How a function of the module runs: what every long one takes beside its own arguments.
struct Call {
    py::object progress = py::none();  ///< called with (stage, fraction)
    py::object log = py::none();       ///< called with (is_warning, line)
    int threads = 0;
    std::uint64_t memory_limit = 0;

    /// Runs `work` on a thread of its own, without the GIL, and waits for it. Callbacks, and Python's signal handlers
    /// where this is the main thread, are called from here meanwhile; what they raise stops the work, and is raised
    /// once it has ended.
    void run(const std::function<void(const RunContext&)>& work) const;
};

}  // namespace covol::python
