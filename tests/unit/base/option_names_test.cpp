#include "covol/option_names.h"

#include <catch2/catch.hpp>

#include "covol/error.h"

using namespace covol;

namespace {

/// As a form would: "[field]" or "[field: value]".
std::string in_form(const std::string& message) {
    return replace_names(
        message, [](const NamedOption& o) { return "[" + o.field + (o.value.empty() ? "" : ": " + o.value) + "]"; });
}

}  // namespace

TEST_CASE("options that a message names are found, with their values, and replaced") {
    CHECK(in_form("use a larger `voxel_size`, or `roi`") == "use a larger [voxel_size], or [roi]");
    CHECK(in_form("; `space = Index, order = ZYX` would") == "; [space: Index] [order: ZYX] would");
    CHECK(in_form("`spacing = sx,sy,sz` gives it") == "[spacing: sx,sy,sz] gives it");
    const std::vector<NamedOption> named = find_named_options("`max_steps = 0, tag_distance = 1.5e-3` or `delta`");
    REQUIRE(named.size() == 3);
    CHECK((named[0].field == "max_steps" && named[0].value == "0"));
    CHECK((named[1].field == "tag_distance" && named[1].value == "1.5e-3"));
    CHECK((named[2].field == "delta" && named[2].value.empty()));
}

TEST_CASE("other text between backquotes stays as it is") {
    for (const char* text :
         {"", "no option", "what `covol band` wrote", "`Roi`", "``", "`", "a `b", "`x = `` y", "cells`7.tif: `z9`"}) {
        CHECK(in_form(text) == text);
        CHECK(find_named_options(text).empty());
    }
    CHECK(in_form("its name has a ` in it; choose a part with `roi`") ==
          "its name has a ` in it; choose a part with [roi]");
}

TEST_CASE("an error tells the option that would help") {
    CHECK(
        Error(Errc::InvalidInput, "segment: the surface vanished; lower `delta`, or give a `tag_distance`").option() ==
        "delta");
    CHECK(Error(Errc::Io, "a.vdb: no such file").option().empty());
}
