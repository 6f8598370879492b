#pragma once
#include <memory>
#include <string>

#include "covol/image.h"
#include "covol/study.h"

// Files that are added to a study: marks, and other programs' results. Each becomes one action.
namespace covol::tool {

/// Maximum sizes of uploads from a page, bytes: of any file such as a mask, and of a file of marks, which is smaller.
inline constexpr std::size_t kMaxFileBytes = std::size_t(256) << 20, kMaxMarksBytes = std::size_t(4) << 20;

/// A file that a page has sent. The destructor deletes it, unless keep() was called.
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

/// Writes a file that a page has sent to the folder of imported files. Its name is the digest of its content, with the
/// ending of `name`.
/// @throws Error InvalidInput: invalid ending, too large, too many files, or a file that refers to others.
[[nodiscard]] GivenFile keep_file(const std::string& name, const std::string& bytes, bool is_marks,
                                  const std::string& folder, const RunContext& run);

/// The action that adds the marks of a file to a structure, with the kinds that the file states. Lines on slices of the
/// image become outlines; other lines become single marks.
/// @throws Error as for read_points() and check_inside(); InvalidInput (too many marks).
[[nodiscard]] StudyAction import_points(const std::string& file, StudyId structure, const ImageGeometry& image,
                                        const RunContext& run);
/// The action that sets the guess of a structure. The file is read, so that an invalid one is reported immediately.
/// @throws Error as for read_guess().
[[nodiscard]] StudyAction import_guess(const std::string& file, StudyId structure, const std::string& folder,
                                       const StudySite& site, const RunContext& run);
/// The action that adds a structure for each label of a file. @throws Error as for labels_of_file().
[[nodiscard]] StudyAction import_labels(const std::string& file, const std::string& folder, const StudyState& state,
                                        const StudySite& site, const RunContext& run);

}  // namespace covol::tool
