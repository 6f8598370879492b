#pragma once
#include <optional>
#include <string>
#include <vector>

#include "io/dicom/dicom_elements.h"
#include "io/dicom/dicom_slices.h"

// The origin of results that belong to an image, as recorded in SEG and RTSTRUCT files.
namespace covol::detail {

/// The instance and the frame of the series at a plane of the lattice.
struct SourcePlane {
    std::string sop_class, sop_instance;
    std::size_t frame = 0, file_frames = 1;
};

/// The patient, the study and the series of an image; if it is not a DICOM image, a new study.
struct DicomSource {
    DicomItem patient_and_study;  ///< including the character set
    std::string study, frame_of_reference, position_reference;
    std::string series;              ///< empty if the image is not a DICOM image
    DicomItem lossy;                 ///< LossyImageCompression with its ratio and method
    std::vector<DicomSlice> planes;  ///< planes of the volume
    bool is_utf8 = true;             ///< whether any name can be written

    /// The plane of the series at slice k of the lattice; if there are several times or echoes, the first.
    [[nodiscard]] std::optional<SourcePlane> plane_of(const ImageGeometry& geometry, int k) const;
    /// A name of at most `longest` letters for an LO or SH element.
    [[nodiscard]] std::string name(const std::string& given, std::size_t longest) const;
    /// A reference to an instance, and to the frame if the instance has several.
    static DicomItem reference(const SourcePlane& plane);
    /// Patient, study, equipment and the elements that every instance has, except its UIDs.
    [[nodiscard]] DicomItem instance(const std::string& own_modality, const std::string& description) const;
    /// The module Common Instance Reference (PS3.3 C.12.2): the instances of the series that were used.
    void refer(DicomItem& file, const std::vector<SourcePlane>& used) const;
};

/// @param like  the image: a folder or a file; formats other than DICOM have no series
/// @param frame  the chosen volume of the series (times, echoes, stacks)
/// @param geometry  of the lattice; the frame of reference is derived from it if the image is not a DICOM image
DicomSource read_dicom_source(const std::string& like, std::optional<int> frame, const ImageGeometry& geometry,
                              const RunContext& run);

/// A lattice in mm, as DICOM requires; numbers without a unit are taken as mm. @throws Error Unsupported (rows and
/// columns that are not perpendicular)
ImageGeometry in_millimetres(const std::string& path, const ImageGeometry& geometry, const RunContext& run);

/// The date and the time of this run, in UTC, or those given by SOURCE_DATE_EPOCH.
struct DicomTime {
    std::string date, time;
};
DicomTime dicom_time();

}  // namespace covol::detail
