#include <algorithm>
#include <array>
#include <optional>
#include <utility>

#include "machines/definition/sections.h"

namespace smoothpost::machine_file {

namespace {

std::string usual_extension(const std::string& dialect) {
  // a dialect, or the first part of the names of several
  static constexpr std::array<std::pair<std::string_view, const char*>, 11> kRows = {
      {{"beckhoff", "nc"},
       {"fanuc_30i", "nc"},
       {"fanuc_ls", "ls"},
       {"grbl", "gcode"},
       {"heidenhain", "h"},
       {"krl", "src"},
       {"linuxcnc", "ngc"},
       {"rapid", "mod"},
       {"ros", "yaml"},
       {"siemens_840d", "mpf"},
       {"urscript", "script"}}};
  for (const auto& [name, extension] : kRows)
    if (dialect.compare(0, name.size(), name) == 0) return extension;
  return "txt";
}

TomlTable* table_of(TomlTable& root, const std::string& key) {
  TomlEntry* entry = root.find(key);
  return entry != nullptr && entry->value.kind == TomlKind::table ? &entry->value.table : nullptr;
}

void remove(TomlTable& table, std::string_view key) {
  TomlTable kept;
  for (const auto& entry : table.entries())
    if (entry.key != key) kept.add(entry);
  table = std::move(kept);
}

void put(TomlTable& table, const TomlEntry& entry) {
  if (TomlEntry* there = table.find(entry.key))
    *there = entry;
  else
    table.add(entry);
}

/// The table `key` of the file, an empty one when it has none. Nothing: the key is no table.
TomlTable* table_to_change(TomlTable& root, const std::string& key, const SourceLocation& where) {
  if (root.find(key) == nullptr) {
    TomlEntry added{key, where, {}};
    added.value.kind = TomlKind::table;
    added.value.where = where;
    root.add(std::move(added));
  }
  return table_of(root, key);
}

std::string dialect_name(TomlTable& root) {
  const TomlTable* dialect = table_of(root, "dialect");
  const TomlEntry* name = dialect != nullptr ? dialect->find("name") : nullptr;
  if (name == nullptr || name->value.kind != TomlKind::string) return DialectSettings{}.name;
  return name->value.string;
}

void leave_own_controller(TomlTable& root, const std::string& name, const SourceLocation& where) {
  if (TomlTable* process = table_of(root, "process")) remove(*process, "events");
  TomlTable* dialect = table_to_change(root, "dialect", where);
  if (dialect == nullptr) return;
  remove(*dialect, "start");
  remove(*dialect, "end");
  TomlEntry extension{"extension", where, {}};
  extension.value.kind = TomlKind::string;
  extension.value.where = where;
  extension.value.string = usual_extension(name);
  put(*dialect, extension);
}

void lay_over(TomlTable& root, TomlTable& variant, const SourceLocation& where) {
  if (TomlTable* settings = table_of(variant, "dialect")) {
    TomlTable* dialect = table_to_change(root, "dialect", where);
    TomlTable left;
    for (const auto& entry : settings->entries()) {
      if (entry.key == "name" || dialect == nullptr)
        left.add(entry);
      else
        put(*dialect, entry);
    }
    *settings = std::move(left);
  }
  TomlEntry* words = variant.find("process");
  if (words == nullptr || words->value.kind != TomlKind::table) return;
  TomlTable* process = table_to_change(root, "process", where);
  if (process == nullptr) return;
  const TomlEntry* power = process->find("power");
  const std::optional<TomlEntry> kept = power != nullptr ? std::optional(*power) : std::nullopt;
  TomlEntry taken = std::move(*words);
  *words = TomlEntry{"process", taken.where, {}};
  words->value.kind = TomlKind::table;
  words->value.where = taken.value.where;
  if (kept && taken.value.table.find("power") == nullptr) taken.value.table.add(*kept);
  put(root, taken);
}

/// The last override of dialect.name.
const MachineOverride* chosen_name(const std::vector<MachineOverride>& overrides) {
  const MachineOverride* chosen = nullptr;
  for (const auto& change : overrides)
    if (change.key == "dialect.name") chosen = &change;
  return chosen;
}

bool is_of_variant(const MachineOverride& change) { return change.key.rfind("variant.", 0) == 0; }

void check_variant(const TomlEntry& entry, const CycleSettings& cycle, Problems& problems) {
  const std::string title = "[variant." + entry.key.substr(0, 64) + "]";
  if (entry.value.kind != TomlKind::table) {
    problems.error("MF106", title + " is " + to_string(entry.value.kind) + " and has to be a table",
                   entry.value.where);
    return;
  }
  TableReader variant(&entry.value.table, title, entry.value.where, problems);
  TableReader dialect = variant.table("dialect", title + " dialect");
  if (dialect.has("name"))
    dialect.error("MF124", "a variant's dialect has its name from the table's: remove name",
                  "name");
  read_dialect(dialect, cycle);
  TableReader process = variant.table("process", title + " process");
  read_process(process, problems);
  if (process.has("power")) read_power(process.table("power", title + " power"));
  process.entry("power");
  process.finish();
  variant.finish();
}

}  // namespace

void choose_dialect(TomlTable& root, const std::vector<MachineOverride>& overrides,
                    Problems& problems) {
  for (const auto& change : overrides)
    if (is_of_variant(change)) apply_override(root, change, problems);
  const std::string own = dialect_name(root);
  TomlTable* variants = table_of(root, "variant");
  if (variants != nullptr && variants->find(own) != nullptr)
    problems.error("MF124",
                   "[variant." + own + "] is never used: it is the dialect of [dialect] itself",
                   variants->find(own)->where);
  if (const MachineOverride* change = chosen_name(overrides)) {
    // As the value will be read: quoted, or a bare word.
    TomlTable probe;
    apply_override(probe, *change, problems);
    const std::string name = dialect_name(probe);
    if (name != own) {
      const SourceLocation where{"--set dialect.name", 0, 0};
      leave_own_controller(root, name, where);
      variants = table_of(root, "variant");
      if (TomlTable* variant = variants != nullptr ? table_of(*variants, name) : nullptr)
        lay_over(root, *variant, where);
    }
  }
  for (const auto& change : overrides)
    if (!is_of_variant(change)) apply_override(root, change, problems);
}

void check_variants(TableReader reader, const CycleSettings& cycle, Problems& problems) {
  for (const auto* entry : reader.entries()) check_variant(*entry, cycle, problems);
}

}  // namespace smoothpost::machine_file
