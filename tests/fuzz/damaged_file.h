#pragma once
#include <filesystem>
#include <functional>
#include <string>
#include <string_view>

/// Bytes as a file of some format, in a folder of their own, read by the reader that covol would use: all of the
/// header, and of an image the first 32^3 voxels.
class DamagedFile {
public:
    /// @param end  of the file's name ("nii.gz"); "points.ply" and "image.vdb" are read as points and as an image,
    /// "zarr" and "zarr3" are metadata followed by a NUL and the first chunk. @throws std::invalid_argument
    explicit DamagedFile(const std::string& end);
    ~DamagedFile();
    DamagedFile(const DamagedFile&) = delete;
    DamagedFile& operator=(const DamagedFile&) = delete;

    /// A covol::Error is an accepted outcome; other exceptions are passed on. Aborts at a mesh or lines with indices
    /// beyond their end.
    void read(std::string_view bytes) const;

private:
    std::function<void(const std::string&)> reader_;
    std::filesystem::path folder_, file_, part_;
};
