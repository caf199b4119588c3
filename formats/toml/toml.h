#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "kernels/core/diagnostic.h"
#include "kernels/core/result.h"

// TOML 1.0 text as a small tree of our own: every key and value knows its place, keys keep the
// order of the file. Values are as written (no units, no meaning).
namespace smoothpost {

struct TomlEntry;

/// The keys of one table in the order of the text.
class TomlTable {
 public:
  const std::vector<TomlEntry>& entries() const { return entries_; }
  /// The entry with that key, or nullptr. Cost: linear. Valid until the table changes.
  const TomlEntry* find(std::string_view key) const;
  TomlEntry* find(std::string_view key);
  /// Appends an entry. @pre the key is not there yet
  TomlEntry& add(TomlEntry entry);
  std::size_t size() const;

 private:
  std::vector<TomlEntry> entries_;
};

enum class TomlKind { boolean, integer, real, string, date_time, array, table };

/// "a table", "an integer" ...: for messages.
std::string to_string(TomlKind kind);

struct TomlValue {
  TomlKind kind = TomlKind::boolean;
  SourceLocation where;  ///< the first character of the value; of a [table], its header
  bool boolean = false;
  std::int64_t integer = 0;
  double real = 0.0;             ///< also set when kind is integer; may be nan or inf
  std::string string;            ///< kind string, UTF-8
  std::vector<TomlValue> items;  ///< kind array
  TomlTable table;               ///< kind table

  bool is_number() const { return kind == TomlKind::integer || kind == TomlKind::real; }
};

struct TomlEntry {
  std::string key;
  SourceLocation where;  ///< of the key
  TomlValue value;
};

/// Limits that keep hostile text from exhausting memory or the stack.
inline constexpr std::size_t kMaxTomlBytes = std::size_t{4} << 20;
inline constexpr int kMaxTomlNesting = 32;   ///< of brackets and braces
inline constexpr int kMaxTomlKeyParts = 16;  ///< of one dotted key

/// Reads TOML 1.0. A text that breaks its rules is an error at the first such place [MF101]; one
/// that is longer, deeper or has longer dotted keys than the limits above is an error [MF102].
/// Locations count from 1, columns in bytes. Cost: O(n log n) in the length of the text.
Result<TomlTable> parse_toml(std::string_view text, const std::string& file);

}  // namespace smoothpost
