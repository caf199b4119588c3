#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "kernels/core/diagnostic.h"

namespace smoothpost::nc {

/// A place in the program text; both count from 1.
struct TextPlace {
  std::uint32_t line = 0;
  std::uint32_t column = 0;
};

/// Collects diagnostics of one program and the files of its subroutines; of each severity the first
/// kLimit are kept, the others counted. One that is told again for the same place is dropped: loops
/// come to a fault again and again.
class DiagnosticLog {
 public:
  static constexpr std::size_t kLimit = 100;

  explicit DiagnosticLog(std::string file) : files_{std::move(file)} {}

  /// Following places are in `file`.
  void enter_file(const std::string& file);

  void error(const char* code, std::string text, TextPlace place) {
    add(Severity::error, code, std::move(text), place);
  }
  /// In the program's own text, wherever the run is.
  void program_error(const char* code, std::string text, TextPlace place) {
    const std::size_t file = std::exchange(file_, 0);
    add(Severity::error, code, std::move(text), place);
    file_ = file;
  }
  void warning(const char* code, std::string text, TextPlace place) {
    add(Severity::warning, code, std::move(text), place);
  }
  void note(const char* code, std::string text, TextPlace place) {
    add(Severity::note, code, std::move(text), place);
  }
  /// A diagnostic of another reader, with its own file.
  void adopt(const Diagnostic& diagnostic);
  bool has_error() const { return counts_[static_cast<std::size_t>(Severity::error)] > 0; }
  std::size_t errors() const { return counts_[static_cast<std::size_t>(Severity::error)]; }

  /// The diagnostics in order of the file, those of the program first; when some were left out a
  /// closing note gives the counts.
  Diagnostics take();

 private:
  void add(Severity severity, const char* code, std::string text, TextPlace place);

  struct Entry {
    Diagnostic diagnostic;
    std::size_t file = 0;
  };

  std::vector<std::string> files_;  ///< in the order of entering
  std::size_t file_ = 0;
  std::vector<Entry> list_;
  std::size_t counts_[3] = {0, 0, 0};
};

}  // namespace smoothpost::nc
