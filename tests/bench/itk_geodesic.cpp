// ITK's GeodesicActiveContourLevelSetImageFilter on covol's image, edge detector and start.
//
//   bench_itk --image I.nrrd --radius R --edge-k K [--sigma V] [--propagation P --curvature C --advection A]
//             [--iterations N] [--rms E] [--threads T] [--mesh OUT.ply]
//
// The start is the signed distance to the sphere of radius R around the origin, in world units. The filter works in
// voxels (spacing 1), and sigma is in voxels. K is the constant of the edge detector as covol reports it, per world
// unit. One line of JSON goes to stdout.
#include <itkGeodesicActiveContourLevelSetImageFilter.h>
#include <itkGradientMagnitudeRecursiveGaussianImageFilter.h>
#include <itkImageFileReader.h>
#include <itkImageRegionIteratorWithIndex.h>
#include <itkMultiThreaderBase.h>
#include <itkNrrdImageIO.h>

#include <nlohmann/json.hpp>

#include <algorithm>
#include <cmath>
#include <iostream>

#include "support.h"

using namespace covol;

namespace {

using Volume = itk::Image<float, 3>;
using Iterator = itk::ImageRegionIteratorWithIndex<Volume>;

struct Input {
    Volume::Pointer image;  // values in [0, 1]; spacing 1
    Domain domain;
};

Input read_input(const bench::Arguments& arguments) {
    auto reader = itk::ImageFileReader<Volume>::New();
    reader->SetImageIO(itk::NrrdImageIO::New());
    reader->SetFileName(arguments.text("image"));
    reader->Update();
    Input input{reader->GetOutput(), {}};
    input.image->DisconnectPipeline();
    const auto size = input.image->GetLargestPossibleRegion().GetSize();
    input.domain.voxel_size = input.image->GetSpacing()[0];
    for (int a = 0; a < 3; ++a) {
        input.domain.origin[a] = input.image->GetOrigin()[a];
        input.domain.max[a] = int(size[a]) - 1;
    }
    const double low = arguments.number("low", 0), high = arguments.number("high", 255);
    for (Iterator at(input.image, input.image->GetLargestPossibleRegion()); !at.IsAtEnd(); ++at)
        at.Set(float(std::clamp((at.Get() - low) / (high - low), 0.0, 1.0)));
    constexpr double kUnit[3] = {1, 1, 1}, kZero[3] = {0, 0, 0};
    input.image->SetSpacing(kUnit);
    input.image->SetOrigin(kZero);
    return input;
}

Volume::Pointer edge_detector(const Input& input, double sigma, double edge_k) {
    auto gradient = itk::GradientMagnitudeRecursiveGaussianImageFilter<Volume, Volume>::New();
    gradient->SetInput(input.image);
    gradient->SetSigma(sigma);
    gradient->Update();
    Volume::Pointer g = gradient->GetOutput();
    g->DisconnectPipeline();
    const double h = input.domain.voxel_size, k_per_voxel = edge_k / (h * h);
    for (Iterator at(g, g->GetLargestPossibleRegion()); !at.IsAtEnd(); ++at)
        at.Set(float(1 / (1 + k_per_voxel * at.Get() * at.Get())));
    return g;
}

Volume::Pointer sphere_start(const Input& input, double radius) {
    auto start = Volume::New();
    start->CopyInformation(input.image);
    start->SetRegions(input.image->GetLargestPossibleRegion());
    start->Allocate();
    for (Iterator at(start, start->GetLargestPossibleRegion()); !at.IsAtEnd(); ++at) {
        const auto i = at.GetIndex();
        const Vec3 x = input.domain.index_to_world({double(i[0]), double(i[1]), double(i[2])});
        at.Set(float((test::length(x) - radius) / input.domain.voxel_size));
    }
    return start;
}

void write_result(const std::string& path, const Input& input, const Volume& level_set) {
    const Index3 n = test::size_of(input.domain);
    test::DenseField u(n[0], n[1], n[2], input.domain.voxel_size);
    for (int i = 0; i < n[0]; ++i)
        for (int j = 0; j < n[1]; ++j)
            for (int k = 0; k < n[2]; ++k) u.at(i, j, k) = input.domain.voxel_size * level_set.GetPixel({i, j, k});
    bench::write_zero_level(path, input.domain, u, 3 * input.domain.voxel_size);
}

int run(const bench::Arguments& arguments) {
    if (const int threads = int(arguments.number("threads", 0)); threads > 0)
        itk::MultiThreaderBase::SetGlobalMaximumNumberOfThreads(threads);
    const bench::Stopwatch watch;
    const Input input = read_input(arguments);
    const Volume::Pointer g = edge_detector(input, arguments.number("sigma", 1), arguments.number("edge-k"));
    const Volume::Pointer start = sphere_start(input, arguments.number("radius"));

    auto filter = itk::GeodesicActiveContourLevelSetImageFilter<Volume, Volume>::New();
    filter->SetInput(start);
    filter->SetFeatureImage(g);
    filter->SetPropagationScaling(arguments.number("propagation", 0));
    filter->SetCurvatureScaling(arguments.number("curvature", 1));
    filter->SetAdvectionScaling(arguments.number("advection", 1));
    filter->SetMaximumRMSError(arguments.number("rms", 0));
    filter->SetNumberOfIterations(itk::IdentifierType(arguments.number("iterations", 800)));
    filter->SetIsoSurfaceValue(0);
    const bench::Stopwatch solve;
    filter->Update();
    const double seconds_solve = solve.wall(), cpu_solve = solve.cpu(), seconds = watch.wall();
    if (!arguments.text("mesh", "").empty()) write_result(arguments.text("mesh"), input, *filter->GetOutput());
    std::cout << nlohmann::json{{"seconds_solve", seconds_solve},
                                {"cpu_solve", cpu_solve},
                                {"seconds_without_mesh", seconds},
                                {"steps", filter->GetElapsedIterations()},
                                {"rms", filter->GetRMSChange()}}
              << '\n';
    return 0;
}

}  // namespace

int main(int argc, char** argv) { return bench::run_program("bench_itk", argc, argv, run); }
