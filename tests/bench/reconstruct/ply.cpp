#include "ply.h"

#include <cstring>
#include <fstream>
#include <map>
#include <sstream>
#include <stdexcept>

namespace {

const std::map<std::string, int> size_of = {{"char", 1},  {"uchar", 1},  {"short", 2},   {"ushort", 2},
                                            {"int", 4},   {"uint", 4},   {"float", 4},   {"double", 8},
                                            {"int8", 1},  {"uint8", 1},  {"int16", 2},   {"uint16", 2},
                                            {"int32", 4}, {"uint32", 4}, {"float32", 4}, {"float64", 8}};

struct Property {
    std::string name, type, type_of_count;  // a list if type_of_count is given, else a number
};

struct Element {
    std::string name;
    std::size_t count = 0;
    std::vector<Property> properties;
};

class Reader {
public:
    explicit Reader(const std::string& path) : path_(path), file_(path, std::ios::binary) {
        if (!file_) fail("cannot be opened");
        std::string line, word;
        while (std::getline(file_, line) && line.rfind("end_header", 0) != 0) {
            std::istringstream words(line);
            words >> word;
            if (word == "format") {
                words >> word;
                if (word != "binary_little_endian" && word != "ascii") fail("expected ASCII or binary little-endian");
                ascii_ = word == "ascii";
            } else if (word == "element") {
                elements_.emplace_back();
                words >> elements_.back().name >> elements_.back().count;
            } else if (word == "property") {
                Property p;
                words >> p.type;
                if (p.type == "list") words >> p.type_of_count >> p.type;
                words >> p.name;
                if (elements_.empty() || !size_of.count(p.type)) fail("bad header: " + line);
                elements_.back().properties.push_back(p);
            }
        }
    }

    Ply read() {
        Ply ply;
        std::map<std::string, double> row;
        for (const Element& element : elements_) {
            for (std::size_t n = 0; n < element.count; ++n) {
                for (const Property& p : element.properties) {
                    if (p.type_of_count.empty()) {
                        row[p.name] = number(p.type);
                    } else if (const int corners = int(number(p.type_of_count)); element.name == "face") {
                        if (corners != 3) fail("expected triangles");
                        auto& triangle = ply.triangles.emplace_back();
                        for (auto& corner : triangle) corner = std::uint32_t(number(p.type));
                    } else {
                        for (int k = 0; k < corners; ++k) number(p.type);
                    }
                }
                if (element.name != "vertex") continue;
                ply.points.push_back({row["x"], row["y"], row["z"]});
                if (row.count("nx")) ply.normals.push_back({row["nx"], row["ny"], row["nz"]});
            }
        }
        if (!file_) fail("ends early");
        return ply;
    }

private:
    double number(const std::string& type) {
        if (ascii_) {
            double value = 0;
            file_ >> value;
            return value;
        }
        char bytes[8] = {};
        file_.read(bytes, size_of.at(type));
        const auto as = [&bytes](auto value) {
            std::memcpy(&value, bytes, sizeof value);
            return double(value);
        };
        if (type == "float" || type == "float32") return as(float{});
        if (type == "double" || type == "float64") return as(double{});
        if (type == "int" || type == "int32") return as(std::int32_t{});
        if (type == "uint" || type == "uint32") return as(std::uint32_t{});
        if (type == "short" || type == "int16") return as(std::int16_t{});
        if (type == "ushort" || type == "uint16") return as(std::uint16_t{});
        if (type == "char" || type == "int8") return as(std::int8_t{});
        return as(std::uint8_t{});
    }

    [[noreturn]] void fail(const std::string& what) const { throw std::runtime_error(path_ + ": " + what); }

    std::string path_;
    std::ifstream file_;
    bool ascii_ = false;
    std::vector<Element> elements_;
};

template <class T>
void put(std::ofstream& file, T value) {
    file.write(reinterpret_cast<const char*>(&value), sizeof value);
}

}  // namespace

Ply read_ply(const std::string& path) { return Reader(path).read(); }

void write_ply(const std::string& path, const Ply& ply) {
    std::ofstream file(path, std::ios::binary);
    file << "ply\nformat binary_little_endian 1.0\nelement vertex " << ply.points.size()
         << "\nproperty float x\nproperty float y\nproperty float z\n";
    if (!ply.normals.empty()) file << "property float nx\nproperty float ny\nproperty float nz\n";
    if (!ply.triangles.empty())
        file << "element face " << ply.triangles.size() << "\nproperty list uchar int vertex_indices\n";
    file << "end_header\n";
    for (std::size_t n = 0; n < ply.points.size(); ++n) {
        for (const double x : ply.points[n]) put(file, float(x));
        if (!ply.normals.empty())
            for (const double x : ply.normals[n]) put(file, float(x));
    }
    for (const auto& triangle : ply.triangles) {
        put(file, std::uint8_t{3});
        for (const auto corner : triangle) put(file, std::int32_t(corner));
    }
    if (!file) throw std::runtime_error(path + ": cannot be written");
}
