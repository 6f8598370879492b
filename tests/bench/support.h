#pragma once
#include <exception>
#include <iostream>
#include <map>
#include <stdexcept>
#include <string>

#include "covol/domain.h"
#include "covol/mesh_io.h"
#include "covol/surface.h"
#include "stopwatch.h"
#include "support/shapes.h"

// Functions that the programs of tests/bench have in common: arguments of the form "--key value", and the extraction of
// meshes from level sets, which is the same for all solvers.
namespace covol::bench {

class Arguments {
public:
    Arguments(int argc, char** argv) {
        for (int i = 1; i + 1 < argc; i += 2) {
            const std::string key = argv[i];
            if (key.rfind("--", 0) != 0) throw std::invalid_argument("expected --key value, got " + key);
            values_[key.substr(2)] = argv[i + 1];
        }
        if (argc % 2 == 0) throw std::invalid_argument(std::string("expected a value after ") + argv[argc - 1]);
    }
    /// @throws std::invalid_argument  the argument --key is not given
    [[nodiscard]] const std::string& text(const std::string& key) const {
        const auto at = values_.find(key);
        if (at == values_.end()) throw std::invalid_argument("expected --" + key);
        return at->second;
    }
    [[nodiscard]] std::string text(const std::string& key, const std::string& fallback) const {
        return values_.count(key) != 0 ? text(key) : fallback;
    }
    [[nodiscard]] double number(const std::string& key) const { return std::stod(text(key)); }
    [[nodiscard]] double number(const std::string& key, double fallback) const {
        return values_.count(key) != 0 ? number(key) : fallback;
    }

private:
    std::map<std::string, std::string> values_;
};

/// The body of main(): an exception of `run` is printed to stderr after the program's name, and the exit code is 1.
inline int run_program(const char* name, int argc, char** argv, int (*run)(const Arguments&)) try {
    return run(Arguments(argc, argv));
} catch (const std::exception& e) {
    std::cerr << name << ": " << e.what() << '\n';
    return 1;
}

/// Writes the zero level set of u, which has a value at each voxel of the domain, as triangles. covol's extraction is
/// used for the results of all solvers, so that only the level sets are compared.
/// @param half_width  voxels with |u| above this value are ignored; world units
inline void write_zero_level(const std::string& path, const Domain& domain, const test::DenseField& u,
                             double half_width) {
    std::vector<char> active(u.size(), 0);
    for (std::size_t p = 0; p < u.size(); ++p) active[p] = std::abs(u[p]) < half_width;
    const FloatGridPtr grid = test::to_grid(domain, u, active, "u", static_cast<float>(half_width));
    write_mesh(path, extract_mesh(*extract_surface(*grid)));
}

}  // namespace covol::bench
