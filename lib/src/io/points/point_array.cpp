#include "covol/point_array.h"

#include "io/points/point_reading.h"

namespace covol {

PointCloud make_cloud(const std::vector<Vec3>& positions, const ReadPointsOptions& reading, const std::string& source) {
    PointCloud cloud;
    cloud.reading = reading;
    cloud.stated = reading.space != PointSpace::Unstated && reading.order != PointOrder::Unstated;
    if (reading.space == PointSpace::Unstated) cloud.reading.space = PointSpace::World;
    if (reading.order == PointOrder::Unstated) cloud.reading.order = PointOrder::XYZ;
    cloud.space = detail::space_after(cloud.reading.space);
    cloud.source = source;
    cloud.rule = detail::describe(cloud.reading);
    cloud.points.reserve(positions.size());
    for (const Vec3& p : positions) cloud.points.push_back(detail::read_as(cloud.reading, p));
    return cloud;
}

}  // namespace covol
