#pragma once
#include <filesystem>
#include <string>

namespace covol::tool {

/// The program of PATH that opens links, xdg-open or open; empty where there is none.
[[nodiscard]] std::string find_opener();

/// Opens a link in the person's browser. The link is a secret, which other users of the machine could read from a
/// command line: the browser is given a file that leads there, and that only this user can read.
class BrowserLink {
public:
    /// @throws Error Io: the file cannot be made
    explicit BrowserLink(const std::string& url);
    ~BrowserLink();  ///< removes the file
    BrowserLink(const BrowserLink&) = delete;
    BrowserLink& operator=(const BrowserLink&) = delete;
    /// False: there is no program that opens links, or it failed.
    [[nodiscard]] bool open() const;

private:
    std::filesystem::path folder_;
};

}  // namespace covol::tool
