#include "covol/report_page.h"

#include <zlib.h>

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>
#include <set>

#include "covol/safe_text.h"
#include "covol/start.h"
#include "covol/surface.h"
#include "report/cluster.h"
#include "report/encoding.h"
#include "report/mesh_codec.h"
#include "report/page_slices.h"
#include "report/viewer.h"
#include "support/scratch.h"

using namespace covol;
using nlohmann::json;

namespace {

constexpr double kRadius = 7.0;
const Vec3 kCenter{3, -20, 100};

TriangleMesh sphere() {
    const Domain domain = make_domain({{-8, -31, 89}, {14, -9, 111}}, 0.5);
    return extract_mesh(*extract_surface(*start_from_sphere(domain, kCenter, kRadius)));
}

double distance_to_center(const std::array<float, 3>& v) {
    return std::hypot(v[0] - kCenter[0], v[1] - kCenter[1], v[2] - kCenter[2]);
}

/// An image of voxels whose values equal their index k.
Image ramp(const Index3& size) {
    ImageGeometry geometry;
    geometry.size = size;
    geometry.spacing = {1, 1, 3.5};
    std::vector<std::uint8_t> values(std::size_t(size[0]) * size[1] * size[2]);
    for (std::size_t n = 0; n < values.size(); ++n) values[n] = std::uint8_t(n / (std::size_t(size[0]) * size[1]));
    return Image::from_values(geometry, values.data());
}

std::vector<std::uint8_t> from_base64(const std::string& text) {
    const std::string digits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    std::vector<std::uint8_t> bytes;
    std::uint32_t bits = 0;
    int count = 0;
    for (const char c : text) {
        if (c == '=') break;
        bits = bits << 6U | std::uint32_t(digits.find(c));
        if ((count += 6) >= 8) bytes.push_back(std::uint8_t(bits >> unsigned(count -= 8) & 255U));
    }
    return bytes;
}

std::size_t count_of(const std::string& text, const std::string& word) {
    std::size_t count = 0;
    for (std::size_t at = text.find(word); at != std::string::npos; at = text.find(word, at + 1)) ++count;
    return count;
}

/// The data in the script element of a page, as a browser finds it.
json data_of(const std::string& page) {
    const std::string open = "<script type=\"application/json\" id=\"data\">";
    const std::size_t begin = page.find(open) + open.size();
    return json::parse(page.substr(begin, page.find("</script", begin) - begin));
}

}  // namespace

TEST_CASE("Base64 encoding matches the test vectors of RFC 4648, section 10") {
    const auto coded = [](const std::string& text) {
        return detail::to_base64(reinterpret_cast<const std::uint8_t*>(text.data()), text.size());
    };
    CHECK(coded("").empty());
    CHECK(coded("f") == "Zg==");
    CHECK(coded("fo") == "Zm8=");
    CHECK(coded("foo") == "Zm9v");
    CHECK(coded("foobar") == "Zm9vYmFy");
}

TEST_CASE("Packed bytes are restored by zlib") {
    std::vector<std::uint8_t> bytes(1000);
    for (std::size_t n = 0; n < bytes.size(); ++n) bytes[n] = std::uint8_t(n * n / 7);
    const std::vector<std::uint8_t> packed = from_base64(detail::pack(bytes));
    std::vector<std::uint8_t> back(bytes.size());
    uLongf size = back.size();
    REQUIRE(uncompress(back.data(), &size, packed.data(), packed.size()) == Z_OK);
    CHECK(size == bytes.size());
    CHECK(back == bytes);
}

TEST_CASE("An encoded mesh has the same triangles, and vertices within half a quantization step") {
    const TriangleMesh mesh = sphere();
    const detail::CodedMesh coded = detail::encode(mesh);
    const TriangleMesh back = detail::decode(coded);
    REQUIRE(back.triangles.size() == mesh.triangles.size());
    REQUIRE(back.vertices.size() == mesh.vertices.size());
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t)
        for (int c = 0; c < 3; ++c) REQUIRE(coded.from[back.triangles[t][c]] == mesh.triangles[t][c]);
    double maximum = 0;
    for (std::size_t v = 0; v < back.vertices.size(); ++v)
        for (int a = 0; a < 3; ++a)
            maximum = std::max(maximum, std::abs(double(back.vertices[v][a]) - mesh.vertices[coded.from[v]][a]));
    CHECK(maximum <= 0.5 * 2 * kRadius / 65535 + 1e-5);  // half a step of 16 bits, plus the rounding of floats near 100
    CHECK(maximum > 0);
    // As neighbouring triangles share vertices, the three corners of a triangle take little more than three bytes.
    CHECK(coded.corners.size() < 6 * mesh.triangles.size());
}

TEST_CASE("Flat meshes, unused vertices and empty meshes are encoded") {
    const TriangleMesh flat{{{9, 9, 9}, {0, 0, 5}, {1, 0, 5}, {0, 1, 5}}, {{1, 2, 3}}};
    const detail::CodedMesh coded = detail::encode(flat);
    CHECK(coded.vertex_count == 3);
    CHECK(detail::decode(coded).vertices == std::vector<std::array<float, 3>>{{0, 0, 5}, {1, 0, 5}, {0, 1, 5}});
    CHECK(detail::decode(detail::encode(TriangleMesh{})).triangles.empty());
}

TEST_CASE("Encoded values are within half a quantization step, and infinity becomes the maximum") {
    const std::vector<float> values{2, 4, 3.1F, std::numeric_limits<float>::infinity(), 2.5F};
    const std::vector<std::uint32_t> from{4, 3, 2, 1, 0};
    const detail::CodedValues coded = detail::encode(values, from);
    CHECK(coded.min == 2);
    CHECK(coded.max == 4);
    std::uint8_t at = 0;
    std::vector<double> back;
    for (const std::uint8_t step : coded.steps) {
        at = std::uint8_t(at + step);
        back.push_back(2 + at * 2.0 / 255);
    }
    const std::vector<double> expected{2.5, 4, 3.1, 4, 2};
    for (std::size_t n = 0; n < back.size(); ++n) CHECK(back[n] == Approx(expected[n]).margin(1.0 / 255));
}

TEST_CASE("Clustering a sphere respects the triangle limit and preserves its volume within 3 percent") {
    const TriangleMesh mesh = sphere();
    std::vector<float> heights;
    for (const auto& v : mesh.vertices) heights.push_back(v[2]);
    const std::int64_t maximum = std::int64_t(mesh.triangles.size()) / 8;
    const detail::PageMesh small = detail::cluster({mesh, {{"height", heights}}}, maximum);
    CHECK(std::int64_t(small.mesh.triangles.size()) <= maximum);
    CHECK(std::int64_t(small.mesh.triangles.size()) > maximum / 3);
    const std::set<std::array<float, 3>> known(mesh.vertices.begin(), mesh.vertices.end());
    for (const auto& v : small.mesh.vertices) REQUIRE(known.contains(v));
    CHECK(measure(small.mesh).volume == Approx(4.0 / 3 * M_PI * std::pow(kRadius, 3)).epsilon(0.03));
    REQUIRE(small.values.size() == 1);
    REQUIRE(small.values[0].second.size() == small.mesh.vertices.size());
    for (std::size_t v = 0; v < small.mesh.vertices.size(); ++v)
        REQUIRE(small.values[0].second[v] == Approx(small.mesh.vertices[v][2]).margin(2.5));
    for (const auto& v : small.mesh.vertices) REQUIRE(distance_to_center(v) == Approx(kRadius).margin(0.05));
    // A mesh that is small enough is unchanged.
    CHECK(detail::cluster({mesh, {}}, std::int64_t(mesh.triangles.size())).mesh.triangles == mesh.triangles);
}

TEST_CASE("Slice plan: a small image whole, of a large one the part around the positions, thinned if necessary") {
    const ImageGeometry geometry = ramp({60, 40, 20}).geometry();
    const VoxelBox all{{0, 0, 0}, {59, 39, 19}};
    const std::vector<Vec3> places{{20, 20, 35}, {30, 25, 40}};
    const detail::SlicePlan whole = detail::plan_slices(geometry, all, places, 60 * 40 * 20);
    CHECK(whole.region == all);
    CHECK(whole.size == Index3{60, 40, 20});
    const detail::SlicePlan part = detail::plan_slices(geometry, all, places, 60 * 40 * 20 - 1);
    CHECK(part.step == Index3{1, 1, 1});
    CHECK(part.region.min == Index3{18, 18, 9});
    CHECK(part.region.max == Index3{32, 27, 12});
    const detail::SlicePlan thin = detail::plan_slices(geometry, all, {}, 60 * 40 * 20 / 4);
    CHECK(thin.step == Index3{2, 2, 1});  // not along k, whose spacing is already the largest
    CHECK(thin.size == Index3{30, 20, 20});
}

TEST_CASE("Encoded slices have the world positions and the intensity range of their voxels") {
    const Image image = ramp({16, 8, 9});
    detail::SlicePlan plan;
    plan.region = {{0, 0, 0}, {15, 7, 8}};
    plan.step = {2, 2, 3};
    plan.size = {8, 4, 3};
    const detail::CodedSlices coded = detail::encode_slices(image, plan, 90, {});
    REQUIRE(coded.jpegs.size() == 3);
    // A voxel of the coded slices is the mean of two voxels along i and j, in the second of three slices.
    CHECK(coded.geometry.origin == Vec3{0.5, 0.5, 3.5});
    CHECK(coded.geometry.spacing == Vec3{2, 2, 10.5});
    CHECK(coded.black == Approx(0).margin(0.1));
    CHECK(coded.white == Approx(8).margin(0.1));
    const std::vector<std::uint8_t> jpeg = from_base64(coded.jpegs[0]);
    CHECK((jpeg[0] == 0xFF && jpeg[1] == 0xD8));
}

TEST_CASE("Names, paths and facts cannot terminate the script of a page") {
    const std::string evil = "</script><script>alert(1)</script><!--<img src=x onerror=alert(1)>&amp;\xff\x1b[31m\"'";
    const TriangleMesh mesh = sphere();
    ReportPage page;
    page.title = evil;
    page.facts = json{{"input", {{"path", evil}}}}.dump(-1, ' ', false, json::error_handler_t::replace);
    page.structures.push_back({evil, {1, 2, 3}, &mesh, {{1, 2, 3}}, nullptr});
    const Scratch scratch;
    const ReportPageSummary made = write_report_page(scratch.path("p.html"), page);
    const std::string text = bytes_of(scratch.path("p.html")), viewer(detail::viewer());
    CHECK(made.bytes == text.size());
    for (const char* word : {"<script", "</script", "<!--", "<img", "onerror=alert(1)>"})
        CHECK(count_of(text, word) == count_of(viewer, word));
    CHECK(count_of(text, "\x1b") == 0);
    const json data = data_of(text);
    CHECK(data["structures"][0]["name"] == safe_text(evil));
    CHECK(data["facts"]["input"]["path"].get<std::string>().starts_with("</script>"));
    CHECK(scratch.file_count() == 1);
}

TEST_CASE("A page contains slices and marks, respects the triangle limit, and is identical with one thread") {
    const TriangleMesh mesh = sphere();
    const Image image = ramp({40, 30, 40});
    ReportPage page;
    page.image = &image;
    page.structures.push_back({"one", {1, 2, 3}, &mesh, std::vector<Vec3>(50, kCenter), nullptr});
    ReportPageOptions options;
    options.max_marks = 20;
    options.max_triangles = 1000;
    const Scratch scratch;
    const ReportPageSummary made = write_report_page(scratch.path("a.html"), page, options);
    CHECK(made.triangles <= 1000);
    CHECK(made.slices_size == Index3{40, 30, 40});
    const std::string text = bytes_of(scratch.path("a.html"));
    const json data = data_of(text);
    CHECK(data["image"]["slices"].size() == 40);
    CHECK(data["structures"][0]["marks"]["count"] == 50);
    CHECK(data["structures"][0]["mesh"]["of_triangles"] == mesh.triangles.size());
    RunContext one;
    one.threads = 1;
    write_report_page(scratch.path("b.html"), page, options, one);
    CHECK(bytes_of(scratch.path("b.html")) == text);
}

TEST_CASE("A page without a surface, or with invalid facts or options, is rejected and leaves no file") {
    const TriangleMesh mesh = sphere(), empty;
    const Scratch scratch;
    ReportPage page;
    const auto write = [&] { (void)write_report_page(scratch.path("p.html"), page); };
    CHECK(code_of(write, "structures: expected at least one") == Errc::InvalidInput);
    page.structures.push_back({"one", {}, &empty, {}, nullptr});
    CHECK(code_of(write, "one: expected a mesh") == Errc::InvalidInput);
    page.structures[0].mesh = &mesh;
    page.frames = {"p_t000.html", "p_t001.html"};
    page.frame = 2;
    CHECK(code_of(write, "frame: expected less than 2, the number of frames, got 2") == Errc::InvalidInput);
    page.frames.clear();
    page.facts = "[1]";
    CHECK(code_of(write, "facts: expected a JSON object") == Errc::InvalidInput);
    page.facts = "{}";
    ReportPageOptions options;
    options.jpeg_quality = 0;
    CHECK(code_of([&] { (void)write_report_page(scratch.path("p.html"), page, options); }) == Errc::InvalidOptions);
    CHECK(scratch.file_count() == 0);
}
