#include "formats/nc/diagnostic_log.h"

#include <algorithm>
#include <utility>

namespace smoothpost::nc {

void DiagnosticLog::add(Severity severity, const char* code, std::string text, TextPlace place) {
  if (++counts_[static_cast<std::size_t>(severity)] > kLimit) return;
  Diagnostic diagnostic;
  diagnostic.severity = severity;
  diagnostic.code = code;
  diagnostic.text = std::move(text);
  diagnostic.where = {file_, static_cast<int>(place.line), static_cast<int>(place.column)};
  list_.push_back(std::move(diagnostic));
}

Diagnostics DiagnosticLog::take() {
  constexpr Severity kAll[] = {Severity::error, Severity::warning, Severity::note};
  Diagnostics out = std::move(list_);
  std::stable_sort(out.begin(), out.end(), [](const Diagnostic& a, const Diagnostic& b) {
    return a.where.line != b.where.line ? a.where.line < b.where.line
                                        : a.where.column < b.where.column;
  });
  for (const Severity severity : kAll) {
    const std::size_t count = counts_[static_cast<std::size_t>(severity)];
    if (count <= kLimit) continue;
    Diagnostic closing;
    closing.severity = Severity::note;
    closing.code = "NC100";
    closing.text = "the first " + std::to_string(kLimit) + " of " + std::to_string(count) + " " +
                   to_string(severity) + "s are listed; mend these and read the file again";
    closing.where.file = file_;
    out.push_back(std::move(closing));
  }
  return out;
}

}  // namespace smoothpost::nc
