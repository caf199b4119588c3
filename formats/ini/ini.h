#pragma once

#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "kernels/core/result.h"

// LinuxCNC's INI files and the lines of HAL files that set values, as written.
namespace smoothpost::ini {

struct Entry {
  std::string key;
  std::string value;  ///< without blanks around it
  SourceLocation where;
};

struct Section {
  std::string name;
  std::vector<Entry> entries;  ///< in the order of the text; a key may stand several times
  SourceLocation where;
};

struct File {
  std::vector<Section> sections;

  const Section* find(std::string_view section) const;
  /// The first entry with that key; nullptr when there is none.
  const Entry* find(std::string_view section, std::string_view key) const;
};

/// Gives the text of a file that another one names, by the name as written; nothing when it is not
/// there or may not be read.
using Source = std::function<std::optional<std::string>(const std::string& name)>;

inline constexpr std::size_t kMaxBytes = std::size_t{4} << 20;
inline constexpr int kMaxFiles = 50;  ///< with those that #INCLUDE names

/// Reads an INI file as LinuxCNC does: [SECTION], KEY = value, comments with # or ; in front, \ at
/// the end goes on in the next line, #INCLUDE FILE. MF201: a line that is none of these, a file
/// that is too large, or more than kMaxFiles. MF207 (warning): an included file that is not there.
/// Cost: linear.
Result<File> read_ini(std::string_view text, const std::string& file, const Source& included);

/// What HAL lines say of the value of a pin.
struct PinValue {
  enum class Kind { unset, number, signal, unreadable };
  Kind kind = Kind::unset;
  double value = 0.0;  ///< of a number
  std::string text;    ///< what stands there; the signal's name
  SourceLocation where;
};

/// The statements setp, sets and net of HAL files, other lines are left alone.
class Hal {
 public:
  /// The lines of one HAL file, or of one [HAL]HALCMD. [SECTION]KEY stands for that value of `ini`.
  void add(std::string_view text, const std::string& file, int first_line, const File& ini);

  /// Of a pin that a net joins with a signal, the last sets of that signal (kind signal: it has no
  /// value that stands in a file); else the last setp of the pin.
  PinValue pin(std::string_view name) const;

 private:
  struct Setting {
    std::string name;
    PinValue value;
  };
  struct Connection {
    std::string pin;
    std::string signal;
    SourceLocation where;
  };
  std::vector<Setting> pins_;
  std::vector<Setting> signals_;
  std::vector<Connection> connections_;
};

/// A number at the front of an INI value; what follows it may be a comment. Nothing: no number, or
/// beyond 1e9.
std::optional<double> leading_number(std::string_view value);

/// The words of a line.
std::vector<std::string> words(std::string_view line);

}  // namespace smoothpost::ini
