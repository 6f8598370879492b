#include "io/dicom/dicom_elements.h"

#include <catch2/catch.hpp>
#include <cmath>
#include <cstdlib>
#include <string>

#include "covol/error.h"
#include "io/dicom/dicom_segmentation.h"
#include "io/dicom/dicom_tree.h"

using namespace covol;
using namespace covol::detail;

TEST_CASE("DICOM: decimal strings have at most 16 characters and a relative error below 1e-8") {
    for (const double value : {0.0, -0.0, 1.5, -1.0 / 3, 1e-7 / 3, -1234567.891234567, 1e22 / 7, -4e-320, 100000.1}) {
        const std::string text = decimal_string(value);
        INFO(text);
        CHECK(text.size() <= 16);
        CHECK(std::strtod(text.c_str(), nullptr) == Approx(value).epsilon(1e-8).margin(1e-300));
    }
    CHECK(decimal_string(-0.0) == "0");
    CHECK(decimal_string(0.1) == "0.1");
}

TEST_CASE("DICOM: UIDs have the root 2.25 of UUIDs, and equal texts have equal UIDs") {
    const std::string uid = dicom_uid("a text");
    CHECK(uid == dicom_uid("a text"));
    CHECK(uid != dicom_uid("another"));
    CHECK(uid.rfind("2.25.", 0) == 0);
    CHECK(uid.size() <= 5 + 39);
    CHECK(uid.find_first_not_of("0123456789.") == std::string::npos);
    CHECK(uid[5] != '0');
}

TEST_CASE("DICOM: nested items are parsed as written, with and without VR, truncated ones without a crash") {
    DicomItem inner, outer, file;
    inner.put(0x30060050, "DS", "1\\2\\3");
    outer.put_items(0x30060040, {inner, inner});
    outer.put(0x30060084, "IS", "7");
    file.put(0x00080016, "UI", "1.2.3");
    file.put_items(0x30060039, {outer});
    for (const bool with_vr : {true, false}) {
        const std::string path = "memory.dcm", bytes = file.encoded(with_vr);
        const DicomTree tree = parse_dicom(path, bytes, {0x30060039, 0x30060040});
        CHECK(tree.text(0x00080016) == "1.2.3");
        REQUIRE(tree.items(0x30060039).size() == 1);
        const DicomTree& item = tree.items(0x30060039)[0];
        CHECK(item.text(0x30060084) == "7");
        REQUIRE(item.items(0x30060040).size() == 2);
        CHECK(item.items(0x30060040)[1].text(0x30060050) == "1\\2\\3");
        CHECK(tree.items(0x30060020).empty());
        // A truncated file is an error or has fewer elements; it is never read beyond its end.
        for (std::size_t end = 0; end < bytes.size(); ++end) {
            const std::string some = bytes.substr(0, end);
            try {
                (void)parse_dicom(path, some, {0x30060039, 0x30060040});
            } catch (const Error& error) {
                CHECK(std::string(error.what()).rfind("memory.dcm: ", 0) == 0);
            }
        }
    }
}

TEST_CASE("DICOM: texts longer than 64 KiB are rejected with explicit VR and written with implicit VR") {
    DicomItem file;
    file.put(0x30060050, "DS", std::string(70000, '1'));
    CHECK_THROWS_AS(file.encoded(true), Error);
    CHECK(file.encoded(false).size() == 8 + 70000);
}

TEST_CASE("DICOM: colours are converted to CIELab with the white point D50") {
    // DICOM stores L as 65535 L / 100, and a and b as 65535 (a + 128) / 255. White is (100, 0, 0), black (0, 0, 0).
    const auto white = to_cielab({255, 255, 255}), black = to_cielab({0, 0, 0}), red = to_cielab({255, 0, 0});
    CHECK(white[0] == 65535);
    for (const auto& grey : {white, black})
        for (const std::size_t n : {1U, 2U}) CHECK(int(grey[n]) == Approx(65535 * 128.0 / 255).margin(3));
    CHECK(black[0] == 0);
    // The red of sRGB has L 54.29, a 80.81 and b 69.89 for the white point D50 (brucelindbloom.com).
    CHECK(red[0] / 655.35 == Approx(54.29).margin(0.02));
    CHECK(red[1] * 255 / 65535.0 - 128 == Approx(80.81).margin(0.05));
    CHECK(red[2] * 255 / 65535.0 - 128 == Approx(69.89).margin(0.05));
}
