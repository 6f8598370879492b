#include "covol/options_table.h"

#include <catch2/catch.hpp>
#include <cmath>

#include "covol/bricks.h"
#include "covol/cloud_cleanup.h"
#include "covol/image_stream.h"
#include "covol/mesh_io.h"
#include "covol/painted.h"
#include "covol/pipeline.h"
#include "covol/points.h"
#include "covol/vdb_io.h"

using namespace covol;

namespace {

enum class Dummy { One, Two };
struct InnerOptions {
    int count = 1;
};
struct DummyOptions {
    std::optional<double> dummy;
    Dummy kind = Dummy::Two;
    std::vector<Vec3> places;
    InnerOptions inner;
};

}  // namespace

// To define an option, a row in a table suffices.
template <>
inline constexpr auto covol::kWords<Dummy> = std::array{"one", "two"};
template <>
inline constexpr auto covol::kOptions<InnerOptions> = std::tuple{Option{"count", &InnerOptions::count, between(1, 3)}};
template <>
inline constexpr auto covol::kOptions<DummyOptions> =
    std::tuple{Option{"dummy", &DummyOptions::dummy, kPositiveLength, Group::Flow, "of no use", "2vx"},
               Option{"kind", &DummyOptions::kind}, Option{"places", &DummyOptions::places}, Part{&DummyOptions::inner},
               Rule<DummyOptions>{"kind", "two with places",
                                  [](const DummyOptions& o) { return o.places.empty() || o.kind == Dummy::Two; }}};

TEST_CASE("for_each_option: options are visited in the order of the tables, including those of parts") {
    DummyOptions options;
    std::string names;
    for_each_option(options, [&](const OptionInfo& option, auto& value) {
        names += option.name + std::string(" ");
        if constexpr (std::is_same_v<std::remove_reference_t<decltype(value)>, int>) value = 2;
    });
    CHECK(names == "dummy kind places count ");
    CHECK(options.inner.count == 2);
    CHECK(std::string(to_string(Dummy::Two)) == "two");
}

TEST_CASE("why_invalid: tables report each invalid field, and rules report invalid combinations") {
    DummyOptions options;
    CHECK(why_invalid(options).empty());
    options.dummy = -1;
    options.inner.count = 4;
    CHECK(why_invalid(options) == "dummy: expected > 0, got -1\ncount: expected 1 to 3, got 4");
    CHECK_THROWS_WITH(require_valid(options, "try"), Catch::StartsWith("try: dummy: expected > 0"));
    try {
        require_valid(options, "try");
    } catch (const Error& error) {
        CHECK(error.code() == Errc::InvalidOptions);
        CHECK(error.option() == "dummy");
    }
    options = {};
    options.kind = Dummy::One;
    options.places = {{0, std::nan(""), 0}};
    CHECK(why_invalid(options) == "places: expected a finite number, got nan\nkind: expected two with places");
    options.places.clear();
    options.kind = Dummy(7);
    CHECK(why_invalid(options).find("kind: expected") == 0);
}

TEST_CASE("Ranges are described as text, include closed ends, and exclude values that are not finite") {
    CHECK(kPositive.text() == "> 0");
    CHECK(kNotNegative.text() == ">= 0");
    CHECK(kFraction.text() == "0 to 1");
    CHECK(kBetween0And1.text() == "between 0 and 1");
    CHECK(Range{0.5, 1, true}.text() == "> 0.5 and <= 1");
    CHECK(Range{}.text() == "a finite number");
    CHECK((kFraction.holds(0) && kFraction.holds(1) && !kBetween0And1.holds(0) && !kBetween0And1.holds(1)));
    for (const double bad : {std::nan(""), double(INFINITY), -double(INFINITY)}) CHECK_FALSE(Range{}.holds(bad));
}

TEMPLATE_TEST_CASE("why_invalid: the default values of each struct of options are valid", "", ExtractOptions,
                   HolesOptions, ReadImageOptions, WriteMeshOptions, WriteVdbOptions, WriteImageOptions, PaintedOptions,
                   ReadPointsOptions, EdgeOptions, EvolveOptions, SegmentOptions, BrickOptions, CloudCleanupOptions) {
    CHECK(why_invalid(TestType{}).empty());
}

TEST_CASE("why_invalid: options of files, images, holes, extraction and edges that are out of range are named") {
    HolesOptions holes;
    holes.distance = 0;
    CHECK(why_invalid(holes) == "hole_distance: expected > 0, got 0");
    ReadImageOptions image;
    image.spacing = {1, 0, 1};
    image.channel = -1;
    image.roi = WorldBox{{0, 0, 0}, {1, -1, 1}};
    CHECK(why_invalid(image) ==
          "spacing: expected > 0, got 0\nchannel: expected >= 0, got -1\nroi: expected min <= max along each axis");
    ReadPointsOptions points;
    points.channels = 0;
    CHECK(why_invalid(points) == "points_channels: expected 1 to 1000, got 0");
    WriteMeshOptions mesh;
    mesh.unit_scale = 0;
    CHECK(why_invalid(mesh) == "unit_scale: expected > 0, got 0");
    WriteVdbOptions vdb;
    vdb.compression = VdbCompression(9);
    CHECK(why_invalid(vdb).find("compression: ") == 0);
    PaintedOptions painted;
    painted.outside_label = -1;
    CHECK(why_invalid(painted) == "painted_outside: expected >= 0, got -1");
    ExtractOptions extract;
    extract.min_component_volume = -1;
    CHECK(why_invalid(extract) == "min_component: expected >= 0, got -1");
    EdgeOptions edge;
    edge.intensities = {2, 2};
    edge.edge_k = edge.edge_contrast = 1;
    CHECK(why_invalid(edge) ==
          "intensities: expected the darker one first\nedge_contrast: expected no `edge_k` at the same time");
}
