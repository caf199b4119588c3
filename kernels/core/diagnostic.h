#pragma once

#include <string>
#include <vector>

namespace smoothpost {

enum class Severity { note, warning, error };

/// A place in a user's file. Lines and columns count from 1 (columns in bytes); 0 means unknown.
struct SourceLocation {
  std::string file;
  int line = 0;
  int column = 0;
};

/// One message for the user: what is wrong, the value with its unit, the limit, what to do.
/// `code` is stable and listed in docs/diagnostics.md; its two-letter family decides the exit
/// status.
struct Diagnostic {
  Severity severity = Severity::error;
  std::string code;
  std::string text;
  SourceLocation where;
};

using Diagnostics = std::vector<Diagnostic>;

/// `file:line:column: severity: text [CODE]`; parts that are unknown are left out.
std::string to_string(const Diagnostic& diagnostic);
std::string to_string(Severity severity);

bool has_error(const Diagnostics& diagnostics);

}  // namespace smoothpost
