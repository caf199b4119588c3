#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace smoothpost::test {

/// A file of the source tree.
std::filesystem::path source_path(std::string_view relative);

/// A file of the shared reference material beside the checkout (../shared), or nothing when it is
/// not there: tests that need it then skip with a WARN.
std::optional<std::filesystem::path> shared_path(std::string_view relative);

/// Every regular file below ../shared/corpus/<folder> whose name ends in one of `extensions`
/// (".gz" files are listed under their unpacked name), sorted. Empty when there is no corpus.
std::vector<std::filesystem::path> corpus_files(std::string_view folder,
                                                const std::vector<std::string>& extensions);

/// The bytes of a file; of the unpacked content when only `<path>.gz` exists or path ends in .gz.
std::string read_bytes(const std::filesystem::path& path);

/// The numbers of a file of lines with commas, one row a line; lines that do not start with a
/// number (headings, comments) are left out.
std::vector<std::vector<double>> number_table(const std::filesystem::path& path);

}  // namespace smoothpost::test
