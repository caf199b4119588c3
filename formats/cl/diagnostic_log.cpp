#include "formats/cl/diagnostic_log.h"

#include <algorithm>
#include <utility>

namespace smoothpost::cl {

void DiagnosticLog::add(Severity severity, const char* code, std::string text, TextPlace place) {
  if (++counts_[static_cast<std::size_t>(severity)] > kLimit) return;
  list_.push_back({severity,
                   code,
                   std::move(text),
                   {file_, static_cast<int>(place.line), static_cast<int>(place.column)}});
}

Diagnostics DiagnosticLog::take() {
  Diagnostics out = std::move(list_);
  std::stable_sort(out.begin(), out.end(), [](const Diagnostic& a, const Diagnostic& b) {
    return a.where.line != b.where.line ? a.where.line < b.where.line
                                        : a.where.column < b.where.column;
  });
  for (const Severity severity : {Severity::error, Severity::warning, Severity::note}) {
    const std::size_t count = counts_[static_cast<std::size_t>(severity)];
    if (count <= kLimit) continue;
    out.push_back({Severity::note,
                   "CL100",
                   "the first " + std::to_string(kLimit) + " of " + std::to_string(count) + " " +
                       to_string(severity) + "s are listed; mend these and read the file again",
                   {file_, 0, 0}});
  }
  return out;
}

}  // namespace smoothpost::cl
