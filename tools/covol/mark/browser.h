#pragma once
#include <filesystem>
#include <string>

namespace covol::tool {

/// The program in PATH that opens links, xdg-open or open; empty if there is none.
[[nodiscard]] std::string find_opener();

/// Opens a link in the user's browser. The link is a secret, and other users of the machine can read command lines.
/// Therefore the browser opens a file that redirects to the link, and that only this user can read.
class BrowserLink {
public:
    /// @throws Error Io: the file cannot be created
    explicit BrowserLink(const std::string& url);
    ~BrowserLink();  ///< removes the file
    BrowserLink(const BrowserLink&) = delete;
    BrowserLink& operator=(const BrowserLink&) = delete;
    /// @return false if there is no program that opens links, or if it failed
    [[nodiscard]] bool open() const;

private:
    std::filesystem::path folder_;
};

}  // namespace covol::tool
