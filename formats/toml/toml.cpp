#include "formats/toml/toml.h"

// The whole parser in this file, whatever the installed package says: errors as values, no
// exceptions. Its assertions are off in every build type: "[[[" breaks one, which would abort, or
// be an assumption for some optimisers; without it a proper error message follows.
#undef TOML_HEADER_ONLY
#undef TOML_SHARED_LIB
#define TOML_HEADER_ONLY 1
#define TOML_EXCEPTIONS 0
#define TOML_ENABLE_FORMATTERS 0
#undef NDEBUG
#define TOML_ASSERT(expr) static_cast<void>(0)
#include <toml++/toml.h>

#include <algorithm>
#include <map>
#include <utility>

namespace smoothpost {

const TomlEntry* TomlTable::find(std::string_view key) const {
  for (const auto& entry : entries_)
    if (entry.key == key) return &entry;
  return nullptr;
}

TomlEntry* TomlTable::find(std::string_view key) {
  for (auto& entry : entries_)
    if (entry.key == key) return &entry;
  return nullptr;
}

TomlEntry& TomlTable::add(TomlEntry entry) {
  entries_.push_back(std::move(entry));
  return entries_.back();
}

std::size_t TomlTable::size() const { return entries_.size(); }

std::string to_string(TomlKind kind) {
  switch (kind) {
    case TomlKind::boolean:
      return "a boolean";
    case TomlKind::integer:
      return "an integer";
    case TomlKind::real:
      return "a decimal number";
    case TomlKind::string:
      return "a string";
    case TomlKind::date_time:
      return "a date or time";
    case TomlKind::array:
      return "a list";
    case TomlKind::table:
      return "a table";
  }
  return "";
}

namespace {

/// Turns the parser's columns (in characters) into columns in bytes.
class LineIndex {
 public:
  explicit LineIndex(std::string_view text) : text_(text) {
    starts_.push_back(0);
    for (std::size_t i = 0; i < text.size(); ++i)
      if (text[i] == '\n') starts_.push_back(i + 1);
  }

  int byte_column(std::size_t line, std::size_t column) const {
    if (line < 1 || line > starts_.size() || column < 1) return static_cast<int>(column);
    auto [it, added] = offsets_.try_emplace(line);
    if (added) it->second = character_offsets(line);
    const auto& offsets = it->second;
    if (column - 1 < offsets.size()) return static_cast<int>(offsets[column - 1]) + 1;
    return static_cast<int>(column);
  }

 private:
  /// Byte offset of every character of a line and of its end; empty when all are one byte long.
  std::vector<std::uint32_t> character_offsets(std::size_t line) const {
    const std::size_t begin = starts_[line - 1];
    const std::size_t end = line < starts_.size() ? starts_[line] : text_.size();
    const std::string_view row = text_.substr(begin, end - begin);
    const auto continues = [](char c) { return (static_cast<unsigned char>(c) & 0xC0U) == 0x80U; };
    std::vector<std::uint32_t> offsets;
    if (std::none_of(row.begin(), row.end(), continues)) return offsets;
    for (std::size_t i = 0; i < row.size(); ++i)
      if (!continues(row[i])) offsets.push_back(static_cast<std::uint32_t>(i));
    offsets.push_back(static_cast<std::uint32_t>(row.size()));
    return offsets;
  }

  std::string_view text_;
  std::vector<std::size_t> starts_;
  mutable std::map<std::size_t, std::vector<std::uint32_t>> offsets_;
};

Diagnostic problem(const char* code, std::string text, SourceLocation where) {
  return {Severity::error, code, std::move(text), std::move(where)};
}

/// Follows strings and comments through TOML text up to what the parser must not see: too deep
/// nesting or too many parts of a dotted key, for the recursion of everything that comes after, and
/// characters that are not ASCII outside of strings and comments, which TOML does not have, and for
/// some of which (U+00A1 to U+0499 in the place of a value) toml++ 3.3 has undefined behaviour.
class Scan {
 public:
  explicit Scan(std::string_view text) : text_(text) {
    if (text.starts_with("\xEF\xBB\xBF")) at_ = 3;
  }

  enum class Found { nothing, depth, foreign };
  Found run() {
    while (at_ < text_.size()) {
      const char c = text_[at_];
      if (c == '#') {
        skip_line();
      } else if (c == '"' || c == '\'') {
        skip_string(c);
      } else {
        if (static_cast<unsigned char>(c) >= 0x80U) return Found::foreign;
        if (!count(c)) return Found::depth;
        ++at_;
      }
    }
    return Found::nothing;
  }

  /// Where it was found.
  std::size_t at() const { return at_; }

 private:
  bool count(char c) {
    if (c == '[' || c == '{') ++depth_;
    if ((c == ']' || c == '}') && depth_ > 0) --depth_;
    if (c == '.') ++dots_;
    const std::string_view ends_key = "[]{}=,\n";
    if (ends_key.find(c) != std::string_view::npos) dots_ = 0;
    return depth_ <= kMaxTomlNesting && dots_ < kMaxTomlKeyParts;
  }

  void skip_line() {
    while (at_ < text_.size() && text_[at_] != '\n') ++at_;
  }

  void skip_string(char quote) {
    const std::string three(3, quote);
    const bool multi_line = text_.substr(at_, 3) == three;
    at_ += multi_line ? 3 : 1;
    while (at_ < text_.size()) {
      if (quote == '"' && text_[at_] == '\\') {
        at_ += 2;
      } else if (multi_line ? text_.substr(at_, 3) == three : text_[at_] == quote) {
        at_ += multi_line ? 3 : 1;
        // Of up to five quotes at the end of a multi-line string the first two belong to it.
        for (int k = 0; multi_line && k < 2 && text_.substr(at_, 1) == three.substr(0, 1); ++k)
          ++at_;
        return;
      } else if (!multi_line && text_[at_] == '\n') {
        return;  // the parser says what is wrong with it
      } else {
        ++at_;
      }
    }
  }

  std::string_view text_;
  std::size_t at_ = 0;
  int depth_ = 0;
  int dots_ = 0;
};

SourceLocation location_of(std::string_view text, std::size_t at, const std::string& file) {
  const std::string_view before = text.substr(0, at);
  const auto line = std::count(before.begin(), before.end(), '\n') + 1;
  const std::size_t newline = before.rfind('\n');
  const std::size_t start = newline == std::string_view::npos ? 0 : newline + 1;
  return {file, static_cast<int>(line), static_cast<int>(at - start) + 1};
}

class TreeBuilder {
 public:
  TreeBuilder(std::string_view text, const std::string& file) : lines_(text), file_(file) {}

  TomlTable table(const toml::table& from) const {
    TomlTable out;
    std::vector<std::pair<const toml::key*, const toml::node*>> rows;
    for (const auto& [key, node] : from) rows.emplace_back(&key, &node);
    std::stable_sort(rows.begin(), rows.end(), [](const auto& a, const auto& b) {
      return a.first->source().begin < b.first->source().begin;
    });
    for (const auto& [key, node] : rows)
      out.add({std::string(key->str()), where(key->source().begin), value(*node)});
    return out;
  }

  SourceLocation where(const toml::source_position& position) const {
    return {file_, static_cast<int>(position.line),
            lines_.byte_column(position.line, position.column)};
  }

 private:
  TomlValue value(const toml::node& node) const {
    TomlValue out;
    out.where = where(node.source().begin);
    if (const auto* as_table = node.as_table()) {
      out.kind = TomlKind::table;
      out.table = table(*as_table);
    } else if (const auto* array = node.as_array()) {
      out.kind = TomlKind::array;
      for (const auto& item : *array) out.items.push_back(value(item));
    } else {
      scalar(node, out);
    }
    return out;
  }

  static void scalar(const toml::node& node, TomlValue& out) {
    if (const auto* text = node.as_string()) {
      out.kind = TomlKind::string;
      out.string = text->get();
    } else if (const auto* integer = node.as_integer()) {
      out.kind = TomlKind::integer;
      out.integer = integer->get();
      out.real = static_cast<double>(out.integer);
    } else if (const auto* real = node.as_floating_point()) {
      out.kind = TomlKind::real;
      out.real = real->get();
    } else if (const auto* boolean = node.as_boolean()) {
      out.kind = TomlKind::boolean;
      out.boolean = boolean->get();
    } else {
      out.kind = TomlKind::date_time;
    }
  }

  LineIndex lines_;
  const std::string& file_;
};

}  // namespace

Result<TomlTable> parse_toml(std::string_view text, const std::string& file) {
  if (text.size() > kMaxTomlBytes)
    return Result<TomlTable>::failure(
        problem("MF102",
                "the file has " + std::to_string(text.size()) + " bytes, more than the " +
                    std::to_string(kMaxTomlBytes) + " that are read: is it a machine file?",
                {file, 0, 0}));
  Scan scan(text);
  const Scan::Found found = scan.run();
  if (found == Scan::Found::depth)
    return Result<TomlTable>::failure(problem(
        "MF102",
        "nested more than " + std::to_string(kMaxTomlNesting) +
            " deep, or a dotted key of more than " + std::to_string(kMaxTomlKeyParts) + " parts",
        location_of(text, scan.at(), file)));
  if (found == Scan::Found::foreign)
    return Result<TomlTable>::failure(
        problem("MF101",
                "not TOML: a character that is not ASCII stands outside of quotes; texts, and "
                "names with such characters, stand in quotes",
                location_of(text, scan.at(), file)));
  const toml::parse_result parsed = toml::parse(text, std::string_view(file));
  const TreeBuilder builder(text, file);
  if (!parsed) {
    const auto& error = parsed.error();
    return Result<TomlTable>::failure(problem("MF101",
                                              "not TOML: " + std::string(error.description()),
                                              builder.where(error.source().begin)));
  }
  return builder.table(parsed.table());
}

}  // namespace smoothpost
