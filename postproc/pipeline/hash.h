#pragma once

#include <string>
#include <string_view>

namespace smoothpost {

/// SHA-256 of `bytes` as 64 lower-case hexadecimal digits.
std::string sha256(std::string_view bytes);

/// A file as it was read or written.
struct FileHash {
  std::string path;
  std::string sha256;  ///< of its bytes

  bool operator==(const FileHash&) const = default;
};

}  // namespace smoothpost
