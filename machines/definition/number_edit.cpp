#include "machines/definition/number_edit.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>

#include "formats/toml/toml.h"

namespace smoothpost {

namespace {

const TomlTable* section(const TomlTable& root, const std::string& axis) {
  const TomlEntry* entry = root.find(axis.empty() ? "tool" : "axis");
  if (entry == nullptr) return nullptr;
  if (axis.empty()) return entry->value.kind == TomlKind::table ? &entry->value.table : nullptr;
  for (const TomlValue& item : entry->value.items) {
    const TomlEntry* name = item.table.find("name");
    if (name != nullptr && name->value.string == axis) return &item.table;
  }
  return nullptr;
}

/// Fixed notation without trailing zeros and without a negative zero.
std::string decimal(double value, int decimals) {
  std::array<char, 64> buffer{};
  const auto end = std::to_chars(buffer.data(), buffer.data() + buffer.size(), value,
                                 std::chars_format::fixed, decimals)
                       .ptr;
  std::string text(buffer.data(), end);
  if (text.find('.') != std::string::npos) {
    text.erase(text.find_last_not_of('0') + 1);
    if (text.back() == '.') text.pop_back();
  }
  return text == "-0" ? "0" : text;
}

/// Offset of the byte at a line and column of the text.
std::size_t offset_of(std::string_view text, const SourceLocation& where) {
  std::size_t at = 0;
  for (int line = 1; line < where.line; ++line) at = text.find('\n', at) + 1;
  return at + static_cast<std::size_t>(where.column) - 1;
}

struct Edit {
  std::size_t at = 0;
  std::size_t length = 0;
  std::string text;
};

}  // namespace

Result<std::string> with_vectors(std::string_view text, const std::string& file,
                                 const std::vector<VectorChange>& changes) {
  const auto tree = parse_toml(text, file);
  if (!tree.ok()) return Result<std::string>::failure(tree.diagnostics());
  std::vector<Edit> edits;
  for (const VectorChange& change : changes) {
    const TomlTable* table = section(tree.value(), change.axis);
    const TomlEntry* entry = table == nullptr ? nullptr : table->find(change.key);
    if (entry == nullptr || entry->value.items.size() != 3)
      return Result<std::string>::failure(
          {Severity::error,
           "MF105",
           (change.axis.empty() ? std::string("[tool]") : "axis " + change.axis) + " has no " +
               change.key + " of three numbers in the file: write it there first",
           {file, 0, 0}});
    for (int i = 0; i < 3; ++i) {
      const TomlValue& item = entry->value.items[static_cast<std::size_t>(i)];
      const std::string now = decimal(change.value[i], change.decimals);
      if (decimal(item.real, change.decimals) == now) continue;
      const std::size_t at = offset_of(text, item.where);
      const std::size_t end = std::min(text.find_first_of(",] \t\r\n#", at), text.size());
      edits.push_back({at, end - at, now});
    }
  }
  std::sort(edits.begin(), edits.end(), [](const Edit& a, const Edit& b) { return a.at > b.at; });
  std::string out(text);
  for (const Edit& e : edits) out.replace(e.at, e.length, e.text);
  return out;
}

}  // namespace smoothpost
