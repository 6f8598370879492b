#pragma once
#include <optional>
#include <string>
#include <vector>

#include "io/dicom/dicom_elements.h"
#include "io/dicom/dicom_slices.h"

// The patient, the study and the series of the image from which results were computed, as recorded in SEG and RTSTRUCT
// files.
namespace covol::detail {

/// The instance and the frame that contain one plane of the image.
struct SourcePlane {
    std::string sop_class, sop_instance;
    std::size_t frame = 0, file_frames = 1;
};

/// The patient, the study and the series of an image; if the image is not a DICOM image, a new study.
struct DicomSource {
    DicomItem patient_and_study;  ///< elements of the modules Patient and Study, and the character set
    std::string study, frame_of_reference, position_reference;
    std::string series;              ///< empty if the image is not a DICOM image
    DicomItem lossy;                 ///< LossyImageCompression with its ratio and method
    std::vector<DicomSlice> planes;  ///< planes of the chosen volume
    bool is_utf8 = true;             ///< texts are UTF-8; otherwise names are limited to ASCII

    /// The plane of the chosen volume that lies within half a voxel of slice k of the lattice; empty if there is none.
    [[nodiscard]] std::optional<SourcePlane> plane_of(const ImageGeometry& geometry, int k) const;
    /// A name of at most `longest` letters for an LO or SH element.
    [[nodiscard]] std::string name(const std::string& given, std::size_t longest) const;
    /// A reference to an instance, and to the frame if the instance has several.
    static DicomItem reference(const SourcePlane& plane);
    /// The elements of the patient, the study, the equipment and the instance, except for the instance's UIDs.
    [[nodiscard]] DicomItem instance(const std::string& own_modality, const std::string& description) const;
    /// Adds the module Common Instance Reference (PS3.3 C.12.2) to `file`: the instances of the series that contain the
    /// planes `used`.
    void refer(DicomItem& file, const std::vector<SourcePlane>& used) const;
};

/// @param like  the image: a folder or a file; images in formats other than DICOM have no series
/// @param frame  the chosen volume of the series (times, echoes, stacks)
/// @param geometry  the lattice, from which UIDs are derived that the image does not state
DicomSource read_dicom_source(const std::string& like, std::optional<int> frame, const ImageGeometry& geometry,
                              const RunContext& run);

/// Converts a lattice to mm, as DICOM requires; lengths without a unit are taken as mm. @throws Error Unsupported (rows
/// and columns that are not perpendicular)
ImageGeometry in_millimetres(const std::string& path, const ImageGeometry& geometry, const RunContext& run);

/// The current local date and time or, if the environment variable SOURCE_DATE_EPOCH is set, those that it gives, in
/// UTC.
struct DicomTime {
    std::string date, time;
};
DicomTime dicom_time();

}  // namespace covol::detail
