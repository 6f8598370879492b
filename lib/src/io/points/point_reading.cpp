#include "io/points/point_reading.h"

#include <cmath>
#include <sstream>
#include <utility>

namespace covol::detail {

PointSpace space_after(PointSpace read_as) {
    if (read_as == PointSpace::Ras) return PointSpace::World;
    return read_as == PointSpace::IndexOne ? PointSpace::Index : read_as;
}

Vec3 read_as(const ReadPointsOptions& reading, Vec3 p) {
    if (reading.order == PointOrder::ZYX) std::swap(p[0], p[2]);
    const double s = reading.scale;
    const auto slice = [&](double z) { return reading.channels > 1 ? std::floor(z / reading.channels) : z; };
    switch (reading.space) {
        case PointSpace::Ras: return {-s * p[0], -s * p[1], s * p[2]};
        case PointSpace::IndexOne: return {p[0] - 1, p[1] - 1, slice(p[2] - 1)};
        case PointSpace::Index: return {p[0], p[1], slice(p[2])};
        case PointSpace::Slices: return {s * p[0], s * p[1], p[2]};
        default: return {s * p[0], s * p[1], s * p[2]};
    }
}

Vec3 direction_as(const ReadPointsOptions& reading, Vec3 v) {
    ReadPointsOptions turned = reading;
    turned.scale = 1;
    return read_as(turned, v);
}

Vec3 undo(const ReadPointsOptions& reading, Vec3 p) {
    const double s = reading.scale;
    switch (reading.space) {
        case PointSpace::Ras: p = {-p[0] / s, -p[1] / s, p[2] / s}; break;
        case PointSpace::IndexOne: p = {p[0] + 1, p[1] + 1, p[2] + 1}; break;
        case PointSpace::Index: break;
        case PointSpace::Slices: p = {p[0] / s, p[1] / s, p[2]}; break;
        default: p = {p[0] / s, p[1] / s, p[2] / s};
    }
    if (reading.order == PointOrder::ZYX) std::swap(p[0], p[2]);
    return p;
}

std::string describe(const ReadPointsOptions& reading) {
    std::ostringstream text;
    text << (reading.order == PointOrder::ZYX ? "z, y, x" : "x, y, z") << " in ";
    switch (reading.space) {
        case PointSpace::Ras: text << "world units, RAS turned to LPS"; break;
        case PointSpace::Index: text << "voxels"; break;
        case PointSpace::IndexOne: text << "voxels counted from 1"; break;
        case PointSpace::Local: text << "world units from the first voxel"; break;
        case PointSpace::Slices: text << "world units from the first voxel, and slices"; break;
        default: text << "world units";
    }
    if (reading.scale != 1) text << ", times " << reading.scale;
    if (reading.channels != 1) text << ", slices of " << reading.channels << " channels";
    return text.str();
}

}  // namespace covol::detail
