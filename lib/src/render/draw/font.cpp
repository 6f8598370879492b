#include "render/draw/font.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <unordered_map>
#include <vector>

namespace covol::figure {
namespace {

constexpr double kUnits = 512;  // units of the outlines per em, the size of the font
constexpr std::uint32_t kUnknown = 0xfffd;

using Place = std::array<double, 2>;
struct Glyph {
    double advance = 0;
    std::vector<std::array<Place, 2>> sides;  // of the glyph's closed outlines, units of 1/512 em
};

class Reader {
public:
    explicit Reader(const char* text) : at_(text) {}
    [[nodiscard]] char next() const { return *at_; }
    char take() { return *at_++; }
    double number() {
        char* end = nullptr;
        const double value = std::strtod(at_, &end);
        at_ = end;
        return value;
    }

private:
    const char* at_;
};

std::unordered_map<std::uint32_t, Glyph> read_font() {
    std::unordered_map<std::uint32_t, Glyph> font;
    Reader reader(kGlyphs);
    while (reader.next() != '\0') {
        Glyph& glyph = font[std::uint32_t(reader.number())];
        glyph.advance = reader.number();
        Place at{0, 0}, first{0, 0};
        const auto moved = [&](const Place& from) {
            const double dx = reader.number();
            return Place{from[0] + dx, from[1] + reader.number()};
        };
        const auto side_to = [&](const Place& to) {
            glyph.sides.push_back({at, to});
            at = to;
        };
        for (char kind = reader.take(); kind != ';'; kind = reader.take()) {
            if (kind == 'm') {
                if (!glyph.sides.empty()) glyph.sides.push_back({at, first});
                at = moved(at);
                first = at;
            } else if (kind == 'l') {
                side_to(moved(at));
            } else {
                const Place start = at, control = moved(at), end = moved(control);
                constexpr int kParts = 6;
                for (int n = 1; n <= kParts; ++n) {
                    const double t = double(n) / kParts, s = 1 - t;
                    side_to({s * s * start[0] + 2 * s * t * control[0] + t * t * end[0],
                             s * s * start[1] + 2 * s * t * control[1] + t * t * end[1]});
                }
            }
        }
        if (!glyph.sides.empty()) glyph.sides.push_back({at, first});
    }
    return font;
}

const Glyph& glyph_of(std::uint32_t code) {
    static const std::unordered_map<std::uint32_t, Glyph> font = read_font();
    const auto found = font.find(code);
    return found != font.end() ? found->second : font.at(kUnknown);
}

/// The code points of a text. Bytes that are not UTF-8 become the replacement character.
std::vector<std::uint32_t> code_points(const std::string& utf8) {
    std::vector<std::uint32_t> codes;
    for (std::size_t n = 0; n < utf8.size();) {
        const auto byte = static_cast<unsigned char>(utf8[n++]);
        const int more = byte < 0x80                   ? 0
                         : byte >= 0xc2 && byte < 0xe0 ? 1
                         : byte >= 0xe0 && byte < 0xf0 ? 2
                         : byte >= 0xf0 && byte < 0xf5 ? 3
                                                       : -1;
        std::uint32_t code = more <= 0 ? byte : byte & (0x3fU >> more);
        bool good = more >= 0;
        for (int m = 0; m < more && good; ++m) {
            good = n < utf8.size() && (static_cast<unsigned char>(utf8[n]) & 0xc0U) == 0x80U;
            if (good) code = (code << 6U) | (static_cast<unsigned char>(utf8[n++]) & 0x3fU);
        }
        codes.push_back(good ? code : kUnknown);
    }
    return codes;
}

/// The fraction of each pixel of a box that letters cover.
class Coverage {
public:
    Coverage(int x, int y, int width, int height)
        : x_(x), y_(y), width_(width), height_(height), cells_(std::size_t(width + 2) * height, 0.0F) {}
    [[nodiscard]] int width() const { return width_; }
    [[nodiscard]] int height() const { return height_; }
    [[nodiscard]] int x() const { return x_; }
    [[nodiscard]] int y() const { return y_; }

    /// Adds one side of an outline. Each cell accumulates the signed area between the side and the cell's right end;
    /// sums from the left are then the fractions that the outline covers.
    void add(Place from, Place to) {
        const double sign = from[1] < to[1] ? 1 : -1;
        if (from[1] > to[1]) std::swap(from, to);
        const double slope = to[1] > from[1] ? (to[0] - from[0]) / (to[1] - from[1]) : 0;
        const int last = std::min(height_ - 1, int(std::floor(to[1] - y_)));
        for (int row = std::max(0, int(std::floor(from[1] - y_))); row <= last; ++row) {
            const double top = std::max(from[1], double(y_ + row)), bottom = std::min(to[1], double(y_ + row + 1));
            if (bottom <= top) continue;
            add_in_row(row, from[0] + (top - from[1]) * slope - x_, from[0] + (bottom - from[1]) * slope - x_,
                       sign * (bottom - top));
        }
    }

    [[nodiscard]] std::vector<float> fractions() const {
        std::vector<float> fractions(std::size_t(width_) * height_);
        for (int row = 0; row < height_; ++row) {
            float sum = 0;
            for (int x = 0; x < width_; ++x) {
                sum += cells_[std::size_t(row) * (width_ + 2) + x];
                fractions[std::size_t(row) * width_ + x] = std::min(1.0F, std::abs(sum));
            }
        }
        return fractions;
    }

private:
    void add_in_row(int row, double x0, double x1, double height) {
        if (x0 > x1) std::swap(x0, x1);
        const double span = x1 - x0;
        for (int x = int(std::floor(x0)); x <= int(std::floor(x1)); ++x) {
            const double low = std::max(x0, double(x)), high = std::min(x1, double(x + 1));
            const double part = span > 1e-12 ? height * std::max(0.0, high - low) / span : height;
            const double rest = part * (x + 1 - 0.5 * (low + high));  // area between the side and the cell's right end
            const int cell = std::clamp(x, 0, width_);
            float* const cells = cells_.data() + std::size_t(row) * (width_ + 2) + cell;
            cells[0] += float(rest);
            cells[1] += float(part - rest);
        }
    }

    int x_, y_, width_, height_;
    std::vector<float> cells_;
};

}  // namespace

double text_width(const std::string& utf8, double size) {
    double width = 0;
    for (const std::uint32_t code : code_points(utf8)) width += glyph_of(code).advance;
    return width * size / kUnits;
}

void draw_text(Canvas& canvas, double x, double y, const std::string& utf8, const TextStyle& style) {
    const double width = text_width(utf8, style.size), scale = style.size / kUnits;
    if (style.align != Align::Left) x -= style.align == Align::Center ? 0.5 * width : width;
    const int rim = int(std::ceil(style.halo)) + 2;
    const int left = int(std::floor(x)) - rim, top = int(std::floor(y - 1.1 * style.size)) - rim;
    Coverage coverage(left, top, int(std::ceil(width)) + 2 * rim + 1, int(std::ceil(1.5 * style.size)) + 2 * rim);
    double at = x;
    for (const std::uint32_t code : code_points(utf8)) {
        const Glyph& glyph = glyph_of(code);
        for (const auto& [from, to] : glyph.sides)
            coverage.add({at + scale * from[0], y - scale * from[1]}, {at + scale * to[0], y - scale * to[1]});
        at += scale * glyph.advance;
    }
    const std::vector<float> fractions = coverage.fractions();
    const auto fraction = [&](int i, int j) {
        const bool in = i >= 0 && j >= 0 && i < coverage.width() && j < coverage.height();
        return in ? fractions[std::size_t(j) * coverage.width() + i] : 0.0F;
    };
    const int reach = int(std::ceil(style.halo));
    for (int j = 0; j < coverage.height(); ++j)
        for (int i = 0; i < coverage.width(); ++i) {
            const int px = left + i, py = top + j;
            if (px < 0 || py < 0 || px >= canvas.width() || py >= canvas.height()) continue;
            float rim_fraction = 0;
            for (int dy = -reach; dy <= reach; ++dy)
                for (int dx = -reach; dx <= reach; ++dx) {
                    const double near = std::clamp(style.halo + 0.5 - std::hypot(dx, dy), 0.0, 1.0);
                    rim_fraction = std::max(rim_fraction, float(near) * fraction(i + dx, j + dy));
                }
            if (style.halo > 0) canvas.blend(px, py, style.halo_color, 0.75 * rim_fraction);
            canvas.blend(px, py, style.color, fraction(i, j));
        }
}

}  // namespace covol::figure
