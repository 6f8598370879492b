#pragma once
#include <memory>
#include <string>

#include "covol/image.h"
#include "covol/study.h"

// Files that become part of a study: marks, and other programs' results. Each becomes one action.
namespace covol::tool {

/// What a page may send at once: a mask is larger than marks are.
inline constexpr std::size_t kMaxFileBytes = std::size_t(256) << 20, kMaxMarksBytes = std::size_t(4) << 20;

/// A file that a page has sent. It is gone with this object, unless it was kept.
class GivenFile {
public:
    explicit GivenFile(std::string path);
    ~GivenFile();
    GivenFile(GivenFile&& other) noexcept = default;
    GivenFile& operator=(GivenFile&&) = delete;
    [[nodiscard]] const std::string& path() const { return *path_; }
    void keep() const { *is_kept_ = true; }

private:
    std::unique_ptr<std::string> path_;
    std::unique_ptr<bool> is_kept_ = std::make_unique<bool>(false);
};

/// Writes it below the study's folder, under a name of the program's own: of the page's name the ending alone is used.
/// @throws Error InvalidInput: no ending of such files, too large, too many of them, or a file that names others.
[[nodiscard]] GivenFile keep_file(const std::string& name, const std::string& bytes, bool is_marks,
                                  const std::string& folder, const RunContext& run);

/// The marks of a file for that structure, of the kinds that it tells; lines on slices of the image become outlines,
/// the marks of other lines are taken one by one. @throws Error as read_points() and check_inside(); InvalidInput (too
/// many).
[[nodiscard]] StudyAction import_points(const std::string& file, StudyId structure, const ImageGeometry& image,
                                        const RunContext& run);
/// Reads it once: what cannot be a guess is an error now. @throws Error as read_guess().
[[nodiscard]] StudyAction import_guess(const std::string& file, StudyId structure, const std::string& folder,
                                       const StudySite& site, const RunContext& run);
/// @throws Error as labels_of_file().
[[nodiscard]] StudyAction import_labels(const std::string& file, const std::string& folder, const StudyState& state,
                                        const StudySite& site, const RunContext& run);

}  // namespace covol::tool
