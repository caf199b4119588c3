#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>

#include "kernels/core/diagnostic.h"

namespace smoothpost::cl {

/// A place in the text; both count from 1, columns in bytes; 0: the file as a whole.
struct TextPlace {
  std::uint32_t line = 0;
  std::uint32_t column = 0;
};

/// Collects diagnostics of one file; of each severity the first kLimit are kept, the others
/// counted.
class DiagnosticLog {
 public:
  static constexpr std::size_t kLimit = 100;

  explicit DiagnosticLog(std::string file) : file_(std::move(file)) {}

  void error(const char* code, std::string text, TextPlace place) {
    add(Severity::error, code, std::move(text), place);
  }
  void warning(const char* code, std::string text, TextPlace place) {
    add(Severity::warning, code, std::move(text), place);
  }
  void note(const char* code, std::string text, TextPlace place) {
    add(Severity::note, code, std::move(text), place);
  }
  bool has_error() const { return counts_[static_cast<std::size_t>(Severity::error)] > 0; }

  /// The diagnostics in order of the file; when some were left out, closing notes [CL100] give the
  /// counts.
  Diagnostics take();

 private:
  void add(Severity severity, const char* code, std::string text, TextPlace place);

  std::string file_;
  Diagnostics list_;
  std::array<std::size_t, 3> counts_{};
};

}  // namespace smoothpost::cl
