#include "formats/nc/subroutine_files.h"

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <system_error>

#include "formats/nc/number.h"

namespace smoothpost::nc {
namespace {

namespace fs = std::filesystem;

bool is_plain(std::string_view name, InputDialect dialect) {
  if (name.empty() || name.size() > 200 || name.front() == '.') return false;
  const bool siemens = dialect == InputDialect::siemens;
  return std::all_of(name.begin(), name.end(), [&](char c) {
    const bool letter = siemens ? c >= 'A' && c <= 'Z' : c >= 'a' && c <= 'z';
    return letter || detail::is_digit(c) || c == '_' || (!siemens && (c == '-' || c == '.'));
  });
}

std::string lower_text(std::string text) {
  for (char& c : text)
    if (c >= 'A' && c <= 'Z') c = static_cast<char>(c + 32);
  return text;
}

std::vector<std::string> file_names(std::string_view name, InputDialect dialect) {
  const std::string text(name);
  if (dialect == InputDialect::linuxcnc) return {text + ".ngc"};
  if (dialect == InputDialect::siemens) {
    const std::string lower = lower_text(text);
    return {text + ".SPF", lower + ".spf", text + ".spf", lower + ".SPF",
            text + ".MPF", lower + ".mpf", text + ".mpf", lower + ".MPF"};
  }
  const std::string padded = std::string(text.size() < 4 ? 4 - text.size() : 0, '0') + text;
  std::vector<std::string> names;
  for (const std::string& number : {padded, text}) {
    for (const char* ending : {".nc", ".ngc"}) {
      names.push_back("O" + number + ending);
      names.push_back(number + ending);
    }
    if (padded == text) break;
  }
  return names;
}

/// Whether `file`, with all links followed, lies directly in `folder`.
bool lies_in(const fs::path& file, const fs::path& folder) {
  std::error_code failed;
  const fs::path real_file = fs::canonical(file, failed);
  if (failed) return false;
  const fs::path real_folder = fs::canonical(folder, failed);
  return !failed && real_file.parent_path() == real_folder;
}

void read(const fs::path& path, SubroutineFile& out) {
  std::ifstream in(path, std::ios::binary);
  std::string text;
  std::vector<char> part(std::size_t{1} << 16);
  while (in && text.size() <= kLargestSubroutine) {
    in.read(part.data(), static_cast<std::streamsize>(part.size()));
    text.append(part.data(), static_cast<std::size_t>(in.gcount()));
  }
  if (text.size() > kLargestSubroutine) {
    out.problem = "it has more than " + std::to_string(kLargestSubroutine) + " bytes";
  } else if (in.bad() || (!in.eof() && in.fail()) || !in.is_open()) {
    out.problem = "it cannot be read";
  } else {
    out.text = std::move(text);
  }
}

}  // namespace

SubroutineFile find_subroutine(const std::vector<std::string>& folders, std::string_view name,
                               InputDialect dialect) {
  SubroutineFile out;
  if (!is_plain(name, dialect)) return out;
  for (const std::string& folder : folders) {
    for (const std::string& file : file_names(name, dialect)) {
      const fs::path path = fs::path(folder) / file;
      std::error_code failed;
      if (!fs::exists(fs::symlink_status(path, failed)) || failed) continue;
      out.name = file;
      out.path = path.string();
      if (!lies_in(path, folder)) {
        out.problem = "a link leads out of its folder";
      } else if (!fs::is_regular_file(path, failed) || failed) {
        out.problem = "it is no regular file";
      } else {
        read(path, out);
      }
      return out;
    }
  }
  return out;
}

}  // namespace smoothpost::nc
