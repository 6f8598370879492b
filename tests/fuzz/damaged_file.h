#pragma once
#include <filesystem>
#include <functional>
#include <string>
#include <string_view>

/// Writes bytes to a file of a given format, in a folder of its own, and reads the file with the reader that covol uses
/// for this format. Of an image, the header and the first 32^3 voxels are read.
class DamagedFile {
public:
    /// @param end  ending of the file's name, which selects the reader ("nii.gz"). A "points.ply" is read as points, an
    /// "image.vdb" as an image. The bytes of "zarr" and "zarr3" are the metadata, a NUL, and the first chunk.
    /// @throws std::invalid_argument  no reader for this ending
    explicit DamagedFile(const std::string& end);
    ~DamagedFile();
    DamagedFile(const DamagedFile&) = delete;
    DamagedFile& operator=(const DamagedFile&) = delete;

    /// Reads the bytes. A covol::Error of the reader is accepted and not thrown; other exceptions are thrown. Aborts if
    /// the result is a mesh or lines with indices of vertices that do not exist.
    void read(std::string_view bytes) const;

private:
    std::function<void(const std::string&)> reader_;
    std::filesystem::path folder_, file_, part_;
};
