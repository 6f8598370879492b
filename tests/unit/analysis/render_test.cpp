#include "covol/render.h"

#include <array>
#include <catch2/catch.hpp>
#include <cmath>
#include <filesystem>

#include "covol/error.h"
#include "covol/phantom.h"
#include "covol/start.h"
#include "covol/surface.h"

using namespace covol;

namespace {

std::array<int, 3> pixel(const Picture& p, int x, int y) {
    const std::uint8_t* c = p.rgb.data() + 3 * (std::size_t(y) * p.width + x);
    return {c[0], c[1], c[2]};
}

int brightness(const std::array<int, 3>& c) { return c[0] + c[1] + c[2]; }

}  // namespace

TEST_CASE("a sphere fills the middle of its panel and leaves the corners to the background") {
    const Domain domain = make_domain({{-1, -1, -1}, {1, 1, 1}}, 0.05);
    const FloatGridPtr sphere = extract_surface(*start_from_sphere(domain, {0, 0, 0}, 0.6));
    RenderOptions options;
    options.width = 404, options.height = 200, options.slices = 0;
    const Picture picture = render(*sphere, options);
    REQUIRE(picture.rgb.size() == 3U * 404 * 200);
    int lit = 0;
    for (int y = 0; y < 200; ++y)
        for (int x = 0; x < 200; ++x) lit += pixel(picture, x, y)[0] > 60;
    // the sphere's box, seen obliquely, bounds the view: its disc covers between a fifth and all of the panel
    CHECK(lit > 200 * 200 / 5);
    CHECK(lit < 200 * 200 * 8 / 10);
    CHECK(brightness(pixel(picture, 100, 100)) > brightness(pixel(picture, 2, 2)) + 100);
}

TEST_CASE("a slice shows the image, the outline where the surface is, and the points") {
    PhantomOptions kind;
    kind.kind = "sphere";
    kind.size = 48;
    const Phantom phantom = make_phantom(kind);
    const Domain domain = make_domain(phantom.image.geometry().world_box(), phantom.image.geometry().spacing[0]);
    const WorldBox box = domain.world_box();
    const double radius = 0.2 * (box.max[0] - box.min[0]);
    const Vec3 center = {0.5 * (box.min[0] + box.max[0]), 0.5 * (box.min[1] + box.max[1]),
                         0.5 * (box.min[2] + box.max[2])};
    const FloatGridPtr sphere = extract_surface(*start_from_sphere(domain, center, radius));
    RenderOptions options;
    options.width = 404, options.height = 200, options.slices = 1;
    const Picture picture = render(*sphere, phantom.image, {center}, options);
    CHECK(pixel(picture, 204 + 100, 100)[2] > pixel(picture, 204 + 100, 100)[0]);  // the dot is cyan
    int orange = 0;
    for (int x = 204; x < 404; ++x) {
        const auto c = pixel(picture, x, 100);
        orange += c[0] > 200 && c[2] < 120;
    }
    CHECK(orange >= 4);  // the outline, crossed twice
    CHECK(orange <= 16);
}

TEST_CASE("pictures are written whole, and bad sizes refused") {
    RenderOptions options;
    options.width = 1;
    CHECK(options.why_invalid().find("width") != std::string::npos);
    const std::string path = (std::filesystem::temp_directory_path() / "covol_render_test.png").string();
    write_png(path, Picture{2, 1, {255, 0, 0, 0, 255, 0}});
    CHECK(std::filesystem::file_size(path) > 8);
    std::filesystem::remove(path);
    CHECK_THROWS_AS(write_png("/no/such/folder/x.png", Picture{1, 1, {0, 0, 0}}), Error);
}
