#pragma once

#include <initializer_list>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "formats/toml/toml.h"
#include "kernels/core/pose.h"

// Reads the values of one TOML table against the keys that the machine file knows. Internal to
// machines/definition: the rules are those of docs/machine_file.md.
namespace smoothpost::machine_file {

/// Collects the errors of one file, at most kMaxErrors of them.
class Problems {
 public:
  static constexpr std::size_t kMaxErrors = 200;

  void error(const char* code, std::string text, const SourceLocation& where);
  void warning(const char* code, std::string text, const SourceLocation& where);
  void add(const Diagnostics& more);
  /// Nothing more would be kept: the rest of the work may be left out.
  bool full() const { return list_.size() >= kMaxErrors; }
  bool any_error() const { return has_error(list_); }
  /// Sorted by place (overrides last), with a closing error when some were left out.
  Diagnostics take();

 private:
  Diagnostics list_;
  std::size_t left_out_ = 0;
};

/// What a number must satisfy.
enum class Bound { any, positive, not_negative };

class TableReader {
 public:
  /// `title` names the table in messages, such as "[tolerance]". `table` outlives the reader;
  /// nullptr stands for a table that the file leaves out.
  TableReader(const TomlTable* table, std::string title, SourceLocation where, Problems& problems);

  // Every getter makes its key known and reports a wrong type or value; then, and when the key is
  // absent, it returns nothing. `required` absent keys are an error.
  TableReader& required() {
    required_ = true;
    return *this;
  }
  std::optional<double> number(std::string_view key, Bound bound = Bound::any);
  /// Absent or wrong: `fallback`.
  double number_or(std::string_view key, double fallback, Bound bound = Bound::any);
  std::optional<int> integer(std::string_view key, int lowest, int highest);
  std::optional<bool> boolean(std::string_view key);
  std::optional<std::string> text(std::string_view key);
  /// One of `allowed`.
  std::optional<std::string> choice(std::string_view key, std::vector<std::string> allowed);
  /// Exactly `count` finite numbers.
  std::optional<std::vector<double>> numbers(std::string_view key, std::size_t count);
  /// Any count of finite numbers.
  std::optional<std::vector<double>> numbers(std::string_view key);
  std::optional<Vec3> vector(std::string_view key);
  /// A list of at most `most` lists of 3 finite numbers.
  std::optional<std::vector<Vec3>> vectors(std::string_view key, std::size_t most);
  /// A list of lists of 2 strings; items that are not are errors and left out.
  std::vector<const TomlValue*> pairs(std::string_view key);
  /// The value of `key` when it is a list of 2 strings, else nullptr.
  const TomlValue* pair(std::string_view key);
  /// Normalised; a zero vector is an error.
  std::optional<Vec3> direction(std::string_view key);
  std::optional<std::vector<std::string>> lines(std::string_view key);
  /// A table; its reader knows where it stands. Absent: a reader of an empty table.
  TableReader table(std::string_view key, std::string title);
  /// The tables of a list of tables.
  std::vector<const TomlValue*> tables(std::string_view key);

  bool has(std::string_view key) const;
  /// All entries of a table whose keys are names of the file's own; they become known.
  std::vector<const TomlEntry*> entries();
  /// Makes a key known without reading it.
  const TomlEntry* entry(std::string_view key);
  /// Place of the value of a key; of the table when it is absent.
  SourceLocation where(std::string_view key) const;
  const SourceLocation& where() const { return where_; }
  const std::string& title() const { return title_; }
  /// At the value of `key`, or at the table when it is absent.
  void error(const char* code, const std::string& text, std::string_view key);
  void error(const char* code, const std::string& text, const SourceLocation& place);
  /// Reports the keys that no getter asked for, with the nearest known key.
  void finish();

 private:
  const TomlEntry* take(std::string_view key, TomlKind kind);
  std::optional<double> finite(const TomlValue& value, const std::string& what);
  bool is_pair(const TomlValue& value, const std::string& what);
  void report_unknown(const TomlEntry& entry);
  bool has_other_unit(std::string_view key) const;

  const TomlTable* table_;
  std::string title_;
  SourceLocation where_;
  Problems* problems_;
  bool required_ = false;
  std::vector<std::string> known_;
};

/// Shortest decimal that reads back as the same number.
std::string to_text(double value);

/// `a, b or c`.
std::string one_of(const std::vector<std::string>& names);

/// A key without its unit: "max_velocity_mm_per_s" is "max_velocity".
std::string_view without_unit(std::string_view key);

}  // namespace smoothpost::machine_file
