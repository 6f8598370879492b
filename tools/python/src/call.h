#pragma once
#include <pybind11/pybind11.h>

#include <cstdint>
#include <functional>

#include "covol/run.h"

namespace covol::python {

namespace py = pybind11;

/// The arguments that control how a function of the module runs; all functions that may take long have them.
struct Call {
    py::object progress = py::none();  ///< called with (stage, fraction)
    py::object log = py::none();       ///< called with (is_warning, line)
    int threads = 0;
    std::uint64_t memory_limit = 0;

    /// Runs `work` on a separate thread without the GIL, and waits for it. Meanwhile callbacks, and Python's signal
    /// handlers if this is the main thread, are called from this thread; exceptions that they raise cancel the work,
    /// and are raised after it has ended.
    void run(const std::function<void(const RunContext&)>& work) const;
};

}  // namespace covol::python
