#include "covol/option_names.h"

#include <catch2/catch.hpp>

#include "covol/error.h"

using namespace covol;

namespace {

/// Formats option names as a form might: "[field]" or "[field: value]".
std::string in_form(const std::string& message) {
    return replace_names(message, [](const std::string& name, const std::string& value) {
        return "[" + name + (value.empty() ? "" : ": " + value) + "]";
    });
}

}  // namespace

TEST_CASE("replace_names: option names between backquotes are replaced together with their values") {
    CHECK(in_form("use a larger `voxel_size`, or `roi`") == "use a larger [voxel_size], or [roi]");
    CHECK(in_form("; `points_space = index, points_order = zyx` would") ==
          "; [points_space: index] [points_order: zyx] would");
    CHECK(in_form("`spacing = sx,sy,sz` gives it") == "[spacing: sx,sy,sz] gives it");
    CHECK(in_form("`max_steps = 0, tag_distance = 1.5e-3` or `delta`") ==
          "[max_steps: 0] [tag_distance: 1.5e-3] or [delta]");
}

TEST_CASE("replace_names: other text between backquotes is unchanged") {
    for (const char* text :
         {"", "no option", "what `covol band` wrote", "`Roi`", "``", "`", "a `b", "`x = `` y", "cells`7.tif: `z9`"})
        CHECK(in_form(text) == text);
    CHECK(in_form("its name has a ` in it; choose a part with `roi`") ==
          "its name has a ` in it; choose a part with [roi]");
}

TEST_CASE("Error: a copy keeps the option to change, and an option in the text alone does not count") {
    const Error error(Errc::InvalidInput, "segment: the surface vanished; lower `delta`, or give a `tag_distance`",
                      "delta");
    const Error copy = error;  // NOLINT: the copy is under test
    CHECK(copy.option() == "delta");
    CHECK(Error(Errc::Io, "a.vdb: no such file; `delta` is only text").option().empty());
}
