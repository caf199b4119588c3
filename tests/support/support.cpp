#include "tests/support/support.h"

#include <algorithm>
#include <cstdio>
#include <fstream>
#include <iterator>
#include <sstream>
#include <stdexcept>

namespace smoothpost::test {

namespace fs = std::filesystem;

fs::path source_path(std::string_view relative) {
  return fs::path(SMOOTHPOST_SOURCE_DIR) / relative;
}

std::optional<fs::path> shared_path(std::string_view relative) {
  const fs::path path = fs::path(SMOOTHPOST_SOURCE_DIR).parent_path() / "shared" / relative;
  if (!fs::exists(path)) return std::nullopt;
  return path;
}

std::vector<fs::path> corpus_files(std::string_view folder,
                                   const std::vector<std::string>& extensions) {
  std::vector<fs::path> files;
  const auto root = shared_path("corpus");
  if (!root) return files;
  for (const auto& entry : fs::recursive_directory_iterator(*root / folder)) {
    if (!entry.is_regular_file()) continue;
    fs::path path = entry.path();
    if (path.extension() == ".gz") path.replace_extension();
    std::string name = path.filename().string();
    std::transform(name.begin(), name.end(), name.begin(),
                   [](unsigned char c) { return std::tolower(c); });
    for (const auto& extension : extensions)
      if (name.size() >= extension.size() &&
          name.compare(name.size() - extension.size(), extension.size(), extension) == 0) {
        files.push_back(path);
        break;
      }
  }
  std::sort(files.begin(), files.end());
  return files;
}

std::string read_bytes(const fs::path& path) {
  const bool gz = path.extension() == ".gz";
  if (!gz && fs::exists(path)) {
    std::ifstream in(path, std::ios::binary);
    return std::string(std::istreambuf_iterator<char>(in), {});
  }
  const std::string packed = gz ? path.string() : path.string() + ".gz";
  if (!fs::exists(packed)) throw std::runtime_error("no such file: " + path.string());
  const std::string command = "gzip -dc '" + packed + "'";
  FILE* pipe = popen(command.c_str(), "r");
  if (!pipe) throw std::runtime_error("cannot run gzip");
  std::string bytes;
  char buffer[1 << 16];
  std::size_t n = 0;
  while ((n = fread(buffer, 1, sizeof buffer, pipe)) > 0) bytes.append(buffer, n);
  pclose(pipe);
  return bytes;
}

std::vector<std::vector<double>> number_table(const fs::path& path) {
  std::vector<std::vector<double>> rows;
  std::istringstream text(read_bytes(path));
  for (std::string line; std::getline(text, line);) {
    if (line.empty() || std::string("-0123456789").find(line[0]) == std::string::npos) continue;
    std::istringstream cells(line);
    rows.emplace_back();
    for (std::string cell; std::getline(cells, cell, ',');) rows.back().push_back(std::stod(cell));
  }
  return rows;
}

}  // namespace smoothpost::test
