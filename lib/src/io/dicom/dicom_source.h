#pragma once
#include <optional>
#include <string>
#include <vector>

#include "io/dicom/dicom_elements.h"
#include "io/dicom/dicom_slices.h"

// What the results of an image say of where they come from: SEG and RTSTRUCT alike.
namespace covol::detail {

/// A plane of the lattice, and what the series has there.
struct SourcePlane {
    std::string sop_class, sop_instance;
    std::size_t frame = 0, file_frames = 1;
};

/// The patient, the study and the series that an image is of; where it is no DICOM image, a study of its own.
struct DicomSource {
    DicomItem patient_and_study;  ///< with the character set
    std::string study, frame_of_reference, position_reference;
    std::string series;              ///< empty: the image is no DICOM image
    DicomItem lossy;                 ///< LossyImageCompression and its ratio and method
    std::vector<DicomSlice> planes;  ///< of the volume
    bool is_utf8 = true;             ///< so that every name can be written

    /// What the series has in slice k of the lattice; of several times or echoes there, the first.
    [[nodiscard]] std::optional<SourcePlane> plane_of(const ImageGeometry& geometry, int k) const;
    /// A name of at most `longest` letters as an LO or SH element has it.
    [[nodiscard]] std::string name(const std::string& given, std::size_t longest) const;
    /// To an instance, and to its frame where it has several.
    static DicomItem reference(const SourcePlane& plane);
    /// Patient, study, equipment and what every instance has, but its UIDs.
    [[nodiscard]] DicomItem instance(const std::string& own_modality, const std::string& description) const;
    /// The module Common Instance Reference (PS3.3 C.12.2): the instances of the series that were used.
    void refer(DicomItem& file, const std::vector<SourcePlane>& used) const;
};

/// @param like  the image: a folder or a file; any other than DICOM has no series
/// @param frame  of the series' volumes (times, echoes, stacks), the one that is meant
/// @param geometry  of the lattice, which names the frame of reference where the image is no DICOM image
DicomSource read_dicom_source(const std::string& like, std::optional<int> frame, const ImageGeometry& geometry,
                              const RunContext& run);

/// A lattice in mm, as DICOM has it; numbers without a unit are taken as mm.
/// @throws Error Unsupported (rows and columns that are not perpendicular)
ImageGeometry in_millimetres(const std::string& path, const ImageGeometry& geometry, const RunContext& run);

/// The date and the time of this run, in UTC, or those of SOURCE_DATE_EPOCH.
struct DicomTime {
    std::string date, time;
};
DicomTime dicom_time();

}  // namespace covol::detail
