#include "kernels/core/diagnostic.h"

#include <algorithm>

namespace smoothpost {

std::string to_string(Severity severity) {
  switch (severity) {
    case Severity::note:
      return "note";
    case Severity::warning:
      return "warning";
    case Severity::error:
      return "error";
  }
  return "error";
}

std::string to_string(const Diagnostic& diagnostic) {
  std::string out;
  if (!diagnostic.where.file.empty()) {
    out += diagnostic.where.file + ":";
    if (diagnostic.where.line > 0) out += std::to_string(diagnostic.where.line) + ":";
    if (diagnostic.where.line > 0 && diagnostic.where.column > 0)
      out += std::to_string(diagnostic.where.column) + ":";
    out += " ";
  }
  out += to_string(diagnostic.severity) + ": " + diagnostic.text;
  if (!diagnostic.code.empty()) out += " [" + diagnostic.code + "]";
  return out;
}

bool has_error(const Diagnostics& diagnostics) {
  return std::any_of(diagnostics.begin(), diagnostics.end(),
                     [](const Diagnostic& d) { return d.severity == Severity::error; });
}

}  // namespace smoothpost
