// Reads and writes PLY meshes. Files in ASCII and in both binary byte orders are read; elements and properties that do
// not belong to the mesh are skipped.
#include <algorithm>
#include <bit>
#include <limits>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "base/load.h"
#include "covol/error.h"
#include "io/mesh/mesh_formats.h"

namespace covol::mesh_io {

using detail::load, detail::lower, detail::next_word, detail::quote, detail::to_number;

namespace {

enum class PlyType { Int8, UInt8, Int16, UInt16, Int32, UInt32, Float, Double };
struct PlyProperty {
    std::string name;  ///< name in lower case
    PlyType type = PlyType::Float;
    std::optional<PlyType> count;  ///< if the property is a list, the type of the number of its entries
};
struct PlyElement {
    std::string name;
    std::uint64_t count = 0;
    std::vector<PlyProperty> properties;

    [[nodiscard]] bool has_list() const {
        return std::any_of(properties.begin(), properties.end(),
                           [](const PlyProperty& p) { return p.count.has_value(); });
    }
    /// Index of the scalar property with this name; the number of properties if there is none.
    [[nodiscard]] std::size_t number_named(std::string_view wanted) const {
        const auto at = std::find_if(properties.begin(), properties.end(),
                                     [&](const PlyProperty& p) { return p.name == wanted && !p.count; });
        return std::size_t(at - properties.begin());
    }
};
enum class PlyFormat { Ascii, Little, Big };

PlyType ply_type(const Source& source, std::string_view name) {
    static constexpr struct {
        std::string_view name;
        PlyType type;
    } kTypes[] = {{"char", PlyType::Int8},     {"int8", PlyType::Int8},     {"uchar", PlyType::UInt8},
                  {"uint8", PlyType::UInt8},   {"short", PlyType::Int16},   {"int16", PlyType::Int16},
                  {"ushort", PlyType::UInt16}, {"uint16", PlyType::UInt16}, {"int", PlyType::Int32},
                  {"int32", PlyType::Int32},   {"uint", PlyType::UInt32},   {"uint32", PlyType::UInt32},
                  {"float", PlyType::Float},   {"float32", PlyType::Float}, {"double", PlyType::Double},
                  {"float64", PlyType::Double}};
    for (const auto& known : kTypes)
        if (known.name == name) return known.type;
    source.fail("expected a PLY type such as float or uchar, got " + quote(name));
}

std::size_t size_of(PlyType type) {
    switch (type) {
        case PlyType::Int8:
        case PlyType::UInt8: return 1;
        case PlyType::Int16:
        case PlyType::UInt16: return 2;
        case PlyType::Double: return 8;
        default: return 4;
    }
}

double load_as(PlyType type, const char* data, bool swap) {
    switch (type) {
        case PlyType::Int8: return load<std::int8_t>(data, swap);
        case PlyType::UInt8: return load<std::uint8_t>(data, swap);
        case PlyType::Int16: return load<std::int16_t>(data, swap);
        case PlyType::UInt16: return load<std::uint16_t>(data, swap);
        case PlyType::Int32: return load<std::int32_t>(data, swap);
        case PlyType::UInt32: return load<std::uint32_t>(data, swap);
        case PlyType::Float: return load<float>(data, swap);
        case PlyType::Double: break;
    }
    return load<double>(data, swap);
}

class PlyReader {
public:
    PlyReader(Source& source, Receiver& receiver) : source_(source), receiver_(receiver) {}

    void read() {
        read_header();
        for (const PlyElement& element : elements_) {
            if (element.name == "vertex")
                read_vertices(element);
            else if (element.name == "face" && receiver_.wants_faces())
                read_faces(element);
            else
                for_each_row(element, 0, [] {});
        }
    }

private:
    /// The position of a property in the current row, as the index of its first word (ASCII) or byte (binary), and the
    /// number of its entries. For a list, this is the position of its first entry, which follows the number of entries.
    struct Place {
        std::size_t at = 0, count = 1;
    };

    void read_header() {
        if (source_.line() != "ply") source_.fail("expected 'ply' in the first line");
        std::optional<PlyFormat> format;
        for (;;) {
            std::string_view line = source_.line();
            const std::string_view key = next_word(line);
            if (key == "end_header") break;
            if (key == "format")
                format = format_named(next_word(line));
            else if (key == "element")
                add_element(line);
            else if (key == "property")
                add_property(line);
            else if (!key.empty() && key != "comment" && key != "obj_info")
                source_.fail("unknown PLY header line " + quote(key));
        }
        if (!format) source_.fail("expected a line 'format' in the PLY header, got none");
        format_ = *format;
        swap_ = (format_ == PlyFormat::Big) != (std::endian::native == std::endian::big);
    }

    [[nodiscard]] PlyFormat format_named(std::string_view name) const {
        if (name == "ascii") return PlyFormat::Ascii;
        if (name == "binary_little_endian") return PlyFormat::Little;
        if (name == "binary_big_endian") return PlyFormat::Big;
        source_.fail("unknown PLY format " + quote(name));
    }

    void add_element(std::string_view line) {
        PlyElement element;
        element.name = next_word(line);
        element.count = source_.number<std::uint64_t>(line, "the element's count");
        elements_.push_back(element);
    }

    void add_property(std::string_view line) {
        if (elements_.empty()) source_.fail("a property before any element");
        PlyProperty property;
        std::string_view type = next_word(line);
        if (type == "list") {
            property.count = ply_type(source_, next_word(line));
            type = next_word(line);
        }
        property.type = ply_type(source_, type);
        property.name = lower(next_word(line));
        elements_.back().properties.push_back(property);
    }

    /// Rejects elements whose rows do not fit into the remaining file, before any memory is allocated.
    /// @param wanted  as in for_each_row()
    void check_size(const PlyElement& element, std::size_t wanted) const {
        std::uint64_t minimum = 0, room = source_.bytes_left();
        if (format_ == PlyFormat::Ascii) {
            minimum = 2 * std::max<std::uint64_t>(wanted, 1);
            ++room;  // one byte more, because the last line may lack its line end
        } else {
            for (const PlyProperty& property : element.properties)
                minimum += size_of(property.count.value_or(property.type));
        }
        if (!element.properties.empty() && element.count > room / minimum)
            source_.fail("the header promises " + std::to_string(element.count) + " of element " + quote(element.name) +
                         ", but the file has room for at most " + std::to_string(room / minimum) + "; it is truncated");
    }

    [[noreturn]] void fail_cut_off(const PlyElement& element, std::uint64_t got) const {
        source_.fail("the file is cut off: expected " + std::to_string(element.count) + " of element " +
                     quote(element.name) + ", got " + std::to_string(got) + "; it is truncated");
    }

    /// Calls visit() for each row; value() and values() then refer to that row.
    /// @param wanted  number of leading properties that every line of an ASCII file must have. The other properties may
    /// be missing, but an incomplete list in the last line is an error, because the file is then truncated
    template <typename Visit>
    void for_each_row(const PlyElement& element, std::size_t wanted, const Visit& visit) {
        if (element.properties.empty()) return;
        check_size(element, wanted);
        places_.assign(element.properties.size(), {});
        if (format_ == PlyFormat::Ascii)
            for_each_line(element, wanted, visit);
        else if (element.has_list())
            for_each_record_with_lists(element, visit);
        else
            for_each_record(element, visit);
    }

    template <typename Visit>
    void for_each_line(const PlyElement& element, std::size_t wanted, const Visit& visit) {
        for (std::uint64_t row = 0; row < element.count; ++row) {
            std::string_view line;
            while (line.empty()) {
                if (source_.at_end()) fail_cut_off(element, row);
                line = source_.line();
            }
            detail::split(line, ' ', words_);
            find_words(element, wanted, row + 1 == element.count);
            visit();
        }
    }

    void find_words(const PlyElement& element, std::size_t wanted, bool is_last) {
        std::size_t at = 0;
        for (std::size_t p = 0; p < element.properties.size(); ++p) {
            Place& place = places_[p] = {at, 1};
            if (element.properties[p].count && at < words_.size()) {
                const auto count = to_number(words_[at]);
                if (!count) source_.fail("expected a number, got " + quote(words_[at]));
                const std::size_t left = words_.size() - at - 1;
                if (!(*count >= 0 && *count <= double(left))) {
                    if (is_last && p >= wanted)
                        source_.fail("the last of " + std::to_string(element.count) + " of element " +
                                     quote(element.name) + " ends early; the file is truncated");
                    if (p < wanted)
                        source_.fail("a list of " + quote(words_[at]) + " entries, but its line has only " +
                                     std::to_string(left) + " left");
                }
                place = {at + 1, std::size_t(std::clamp(*count, 0.0, double(left)))};
            }
            at = place.at + place.count;
            if (p < wanted && at > words_.size())
                source_.fail("expected " + std::to_string(at) + " numbers, got " + std::to_string(words_.size()));
        }
    }

    /// Reads binary rows of constant size; check_size() has checked that the file contains them.
    template <typename Visit>
    void for_each_record(const PlyElement& element, const Visit& visit) {
        std::size_t bytes = 0;
        for (std::size_t p = 0; p < element.properties.size(); ++p) {
            places_[p].at = bytes;
            bytes += size_of(element.properties[p].type);
        }
        row_ = source_.bytes(element.count * bytes).data();
        for (std::uint64_t row = 0; row < element.count; ++row, row_ += bytes) visit();
    }

    template <typename Visit>
    void for_each_record_with_lists(const PlyElement& element, const Visit& visit) {
        const std::string_view rest = source_.rest();
        std::size_t at = 0;
        for (std::uint64_t row = 0; row < element.count; ++row) {
            row_ = rest.data() + at;
            const std::size_t bytes = find_bytes(element, rest.size() - at);
            if (bytes == 0) fail_cut_off(element, row);
            visit();
            at += bytes;
        }
        source_.bytes(at);
    }

    /// Sets the positions of the properties in a binary row with lists. @return the size of the row in bytes; 0 if it
    /// exceeds `left`, the number of remaining bytes
    std::size_t find_bytes(const PlyElement& element, std::size_t left) {
        std::size_t at = 0;
        for (std::size_t p = 0; p < element.properties.size(); ++p) {
            const PlyProperty& property = element.properties[p];
            const std::size_t size = size_of(property.type);
            std::size_t count = 1;
            if (property.count) {
                const std::size_t head = size_of(*property.count);
                if (head > left - at) return 0;
                const double entries = load_as(*property.count, row_ + at, swap_);
                at += head;
                if (!(entries >= 0 && entries * double(size) <= double(left - at))) return 0;
                count = std::size_t(entries);
            }
            if (count * size > left - at) return 0;
            places_[p] = {at, count};
            at += count * size;
        }
        return at;
    }

    /// The value of an entry of property p in the current row; nothing if the word is not a number.
    [[nodiscard]] std::optional<double> find_value(const PlyElement& element, std::size_t p,
                                                   std::size_t entry = 0) const {
        const PlyType type = element.properties[p].type;
        if (format_ != PlyFormat::Ascii) return load_as(type, row_ + places_[p].at + entry * size_of(type), swap_);
        return to_number(words_[places_[p].at + entry]);
    }
    [[nodiscard]] double value(const PlyElement& element, std::size_t p, std::size_t entry = 0) const {
        const auto found = find_value(element, p, entry);
        if (!found) source_.fail("expected a number, got " + quote(words_[places_[p].at + entry]));
        return *found;
    }

    void read_vertices(const PlyElement& element) {
        std::array<std::size_t, 3> position{}, normal{};
        std::size_t wanted = 0;
        for (std::size_t a = 0; a < 3; ++a) {
            const std::string name(1, char('x' + a));
            position[a] = element.number_named(name);
            normal[a] = element.number_named("n" + name);
            if (position[a] == element.properties.size())
                source_.fail("expected a vertex property '" + name +
                             "' of one number, but the vertices have no property '" + name + "' of that kind");
            wanted = std::max(wanted, position[a] + 1);
        }
        const std::size_t last_normal = *std::max_element(normal.begin(), normal.end());
        const bool has_normals = receiver_.wants_normals() && last_normal < element.properties.size();
        if (has_normals) wanted = std::max(wanted, last_normal + 1);
        check_size(element, wanted);
        receiver_.expect_vertices(element.count, has_normals);
        for_each_row(element, wanted, [&] {
            receiver_.vertex({value(element, position[0]), value(element, position[1]), value(element, position[2])});
            if (!has_normals) return;
            Vec3 direction{};
            for (std::size_t a = 0; a < 3; ++a) direction[a] = find_value(element, normal[a]).value_or(0);
            receiver_.normal(direction);
        });
    }

    void read_faces(const PlyElement& element) {
        const auto at = std::find_if(element.properties.begin(), element.properties.end(), [](const PlyProperty& p) {
            return p.count && (p.name == "vertex_indices" || p.name == "vertex_index");
        });
        if (at == element.properties.end() && element.count > 0)
            source_.fail("the faces have no list 'vertex_indices'");
        const auto list = std::size_t(at - element.properties.begin());
        std::vector<std::uint32_t> corners;
        for_each_row(element, list + 1, [&] {
            corners.clear();
            for (std::size_t i = 0; i < places_[list].count; ++i)
                corners.push_back(to_index(source_, value(element, list, i)));
            receiver_.face(corners);
        });
    }

    Source& source_;
    Receiver& receiver_;
    PlyFormat format_ = PlyFormat::Ascii;
    bool swap_ = false;
    std::vector<PlyElement> elements_;
    // The current row: its words (ASCII) or its first byte (binary), and the places of its properties.
    std::vector<std::string_view> words_;
    const char* row_ = nullptr;
    std::vector<Place> places_;
};

}  // namespace

void read_ply(Source& source, Receiver& receiver) { PlyReader(source, receiver).read(); }

void write_ply_header(Output& out, const PlyCounts& counts, bool is_far, const std::vector<std::string>& comments,
                      const std::vector<VertexAttribute>& attributes, bool binary) {
    // Many readers store vertex indices and the number of faces as int.
    constexpr std::uint64_t kMax = std::numeric_limits<std::int32_t>::max();
    if (counts.vertices > kMax || counts.triangles > kMax)
        throw Error(Errc::Unsupported, "PLY holds at most 2^31 - 1 vertices and faces, but the mesh has " +
                                           std::to_string(counts.vertices) + " and " +
                                           std::to_string(counts.triangles) + "; decimate it or use larger voxels");
    out << "ply\nformat " << (binary ? "binary_little_endian" : "ascii") << " 1.0\n";
    for (const std::string& comment : comments) out << "comment " << comment << "\n";
    out << "element vertex " << counts.vertices << "\n";
    for (const char* name : {"x", "y", "z"}) out << "property " << (is_far ? "double " : "float ") << name << "\n";
    for (const char* name : {"nx", "ny", "nz"}) out << "property float " << name << "\n";
    for (const VertexAttribute& attribute : attributes) out << "property float " << attribute.name << "\n";
    out << "element face " << counts.triangles << "\nproperty list uchar uint vertex_indices\nend_header\n";
}

void write_ply_face(Output& out, const Face& triangle) {
    out.raw(std::uint8_t(3));
    out.raw(triangle);
}

void write_ply(Output& out, const Prepared& in) {
    write_ply_header(out, {in.vertices.size(), in.triangles.size()}, in.places.is_far(), in.comments, in.attributes,
                     in.binary);
    for (std::size_t v = 0; v < in.vertices.size(); ++v) {
        if (in.binary) {
            in.places.raw(out, in.vertices[v]);
            out.raw(in.normals[v]);
            for (const VertexAttribute& attribute : in.attributes) out.raw(attribute.values[v]);
        } else {
            in.places.text(out, in.vertices[v]);
            out << " " << in.normals[v];
            for (const VertexAttribute& attribute : in.attributes) out << " " << attribute.values[v];
            out << "\n";
        }
    }
    for (const Face& t : in.triangles) {
        if (in.binary)
            write_ply_face(out, t);
        else
            out << "3 " << std::uint64_t(t[0]) << " " << std::uint64_t(t[1]) << " " << std::uint64_t(t[2]) << "\n";
    }
}

}  // namespace covol::mesh_io
