#include <algorithm>

#include "machines/definition/sections.h"

namespace smoothpost::machine_file {

namespace {

std::vector<std::string> split(const std::string& key) {
  std::vector<std::string> parts(1);
  for (const char c : key) {
    if (c == '.')
      parts.emplace_back();
    else
      parts.back() += c;
  }
  return parts;
}

void relocate(TomlValue& value, const SourceLocation& where) {
  value.where = where;
  for (auto& item : value.items) relocate(item, where);
  TomlTable moved;
  for (const auto& entry : value.table.entries()) {
    TomlEntry copy = entry;
    copy.where = where;
    relocate(copy.value, where);
    moved.add(std::move(copy));
  }
  value.table = std::move(moved);
}

/// The text as a TOML value; what is none counts as a string.
TomlValue value_of(const std::string& text, const SourceLocation& where) {
  TomlValue value;
  value.kind = TomlKind::string;
  value.string = text;
  if (text.find_first_of("\r\n") == std::string::npos) {
    auto parsed = parse_toml("value = " + text, where.file);
    if (parsed.ok() && parsed.value().size() == 1) value = parsed.value().entries().front().value;
  }
  relocate(value, where);
  return value;
}

TomlTable* table_at(TomlTable& table, const std::string& key, const SourceLocation& where) {
  TomlEntry* entry = table.find(key);
  if (entry == nullptr) {
    TomlEntry added{key, where, {}};
    added.value.kind = TomlKind::table;
    added.value.where = where;
    entry = &table.add(std::move(added));
  }
  return entry->value.kind == TomlKind::table ? &entry->value.table : nullptr;
}

/// The table of the list `list` (axis or body) with that name.
TomlTable* item_named(TomlTable& root, const std::string& list, const std::string& name,
                      std::vector<std::string>& names) {
  TomlEntry* entry = root.find(list);
  if (entry == nullptr || entry->value.kind != TomlKind::array) return nullptr;
  for (auto& item : entry->value.items) {
    const TomlEntry* item_name = item.table.find("name");
    if (item_name == nullptr || item_name->value.kind != TomlKind::string) continue;
    if (item_name->value.string == name) return &item.table;
    names.push_back(item_name->value.string.substr(0, 64));
  }
  return nullptr;
}

/// A row of [process.events] that is a string becomes a table, so that it can take another key.
void widen_event_row(TomlTable& events, const std::string& event, const SourceLocation& where) {
  TomlEntry* row = events.find(event);
  if (row == nullptr || row->value.kind != TomlKind::string) return;
  TomlEntry text{"text", row->where, row->value};
  row->value = TomlValue{};
  row->value.kind = TomlKind::table;
  row->value.where = where;
  row->value.table.add(std::move(text));
}

void set_value(TomlTable& table, const std::string& key, TomlValue value) {
  const SourceLocation where = value.where;
  if (TomlEntry* entry = table.find(key)) {
    entry->where = where;
    entry->value = std::move(value);
  } else {
    table.add({key, where, std::move(value)});
  }
}

}  // namespace

void apply_override(TomlTable& root, const MachineOverride& change, Problems& problems) {
  const SourceLocation where{"--set " + change.key, 0, 0};
  const auto parts = split(change.key);
  const bool named = std::all_of(parts.begin(), parts.end(),
                                 [](const std::string& part) { return is_name(part, true); });
  if (!named || parts.size() > static_cast<std::size_t>(kMaxTomlKeyParts)) {
    problems.error("MF121", "not a key of a machine file: write section.key=value", where);
    return;
  }
  TomlTable* table = &root;
  std::size_t next = 0;
  if (parts[0] == "axis" || parts[0] == "body") {
    if (parts.size() < 3) {
      problems.error("MF121", "write " + parts[0] + ".NAME.key=value", where);
      return;
    }
    std::vector<std::string> names;
    table = item_named(root, parts[0], parts[1], names);
    if (table == nullptr) {
      problems.error("MF121",
                     "the machine has no " + parts[0] + " " + parts[1] +
                         (names.empty() ? std::string() : "; there are " + one_of(names)),
                     where);
      return;
    }
    next = 2;
  }
  for (; next + 1 < parts.size(); ++next) {
    if (next == 2 && parts[0] == "process" && parts[1] == "events")
      widen_event_row(*table, parts[next], where);
    table = table_at(*table, parts[next], where);
    if (table == nullptr) {
      problems.error("MF121", parts[next] + " is a value, not a table with keys", where);
      return;
    }
  }
  set_value(*table, parts.back(), value_of(change.value, where));
}

}  // namespace smoothpost::machine_file
