#include "formats/nc/diagnostic_log.h"

#include <algorithm>
#include <tuple>
#include <utility>

namespace smoothpost::nc {

void DiagnosticLog::enter_file(const std::string& file) {
  const auto found = std::find(files_.begin(), files_.end(), file);
  file_ = static_cast<std::size_t>(found - files_.begin());
  if (found == files_.end()) files_.push_back(file);
}

void DiagnosticLog::adopt(const Diagnostic& diagnostic) {
  const std::size_t now = file_;
  enter_file(diagnostic.where.file);
  add(diagnostic.severity, diagnostic.code.c_str(), diagnostic.text,
      {static_cast<std::uint32_t>(diagnostic.where.line),
       static_cast<std::uint32_t>(diagnostic.where.column)});
  file_ = now;
}

void DiagnosticLog::add(Severity severity, const char* code, std::string text, TextPlace place) {
  for (const Entry& entry : list_) {
    const Diagnostic& told = entry.diagnostic;
    if (entry.file == file_ && told.where.line == static_cast<int>(place.line) &&
        told.where.column == static_cast<int>(place.column) && told.code == code &&
        told.text == text) {
      return;
    }
  }
  if (++counts_[static_cast<std::size_t>(severity)] > kLimit) return;
  Diagnostic diagnostic;
  diagnostic.severity = severity;
  diagnostic.code = code;
  diagnostic.text = std::move(text);
  diagnostic.where = {files_[file_], static_cast<int>(place.line), static_cast<int>(place.column)};
  list_.push_back({std::move(diagnostic), file_});
}

Diagnostics DiagnosticLog::take() {
  constexpr Severity kAll[] = {Severity::error, Severity::warning, Severity::note};
  std::stable_sort(list_.begin(), list_.end(), [](const Entry& a, const Entry& b) {
    const auto key = [](const Entry& e) {
      return std::tuple(e.file, e.diagnostic.where.line, e.diagnostic.where.column);
    };
    return key(a) < key(b);
  });
  Diagnostics out;
  for (Entry& entry : list_) out.push_back(std::move(entry.diagnostic));
  list_.clear();
  for (const Severity severity : kAll) {
    const std::size_t count = counts_[static_cast<std::size_t>(severity)];
    if (count <= kLimit) continue;
    Diagnostic closing;
    closing.severity = Severity::note;
    closing.code = "NC100";
    closing.text = "the first " + std::to_string(kLimit) + " of " + std::to_string(count) + " " +
                   to_string(severity) + "s are listed; mend these and read the file again";
    closing.where.file = files_.front();
    out.push_back(std::move(closing));
  }
  return out;
}

}  // namespace smoothpost::nc
