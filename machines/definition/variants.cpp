#include <algorithm>
#include <array>
#include <optional>
#include <utility>

#include "machines/definition/sections.h"

namespace smoothpost::machine_file {

namespace {

/// What files of a dialect are like when the machine file does not say it.
struct UsualDialect {
  std::string_view name;  ///< a dialect, or the first part of the names of several
  const char* extension;
  int most_length_digits = 9;  ///< decimals that its words can have
  int most_angle_digits = 9;
};

UsualDialect usual_dialect(const std::string& dialect) {
  static constexpr std::array<UsualDialect, 13> kRows = {{{"beckhoff", "nc"},
                                                          {"fanuc_30i", "nc"},
                                                          {"fanuc_ls", "ls"},
                                                          {"grbl", "gcode"},
                                                          {"heidenhain", "h", 4, 4},
                                                          {"krl", "src"},
                                                          {"linuxcnc", "ngc"},
                                                          {"rapid", "mod"},
                                                          {"ros", "yaml"},
                                                          {"siemens_840d", "mpf"},
                                                          {"urscript", "script"},
                                                          {"val3", "pgx"},
                                                          {"yaskawa_jbi", "jbi", 3, 2}}};
  for (const auto& row : kRows)
    if (dialect.compare(0, row.name.size(), row.name) == 0) return row;
  return {"", "txt"};
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

/// The key's number of digits, `usual` without it, is at most `most`.
void limit_digits(TomlTable& dialect, const char* key, int usual, int most,
                  const SourceLocation& where) {
  const TomlEntry* there = dialect.find(key);
  if (there != nullptr && there->value.kind != TomlKind::integer) return;
  if ((there != nullptr ? there->value.integer : usual) <= most) return;
  TomlEntry digits{key, where, {}};
  digits.value.kind = TomlKind::integer;
  digits.value.where = where;
  digits.value.integer = most;
  digits.value.real = most;
  put(dialect, digits);
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
  const UsualDialect usual = usual_dialect(name);
  extension.value.string = usual.extension;
  put(*dialect, extension);
  limit_digits(*dialect, "digits_mm", 5, usual.most_length_digits, where);
  limit_digits(*dialect, "digits_inch", 6, usual.most_length_digits, where);
  limit_digits(*dialect, "digits_deg", 6, usual.most_angle_digits, where);
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

/// The table of a dialect: the one of its name, or else the longest that its name begins with up to
/// a _, so that [variant.grbl] is for grbl_marlin, too.
TomlTable* variant_for(TomlTable* variants, std::string name) {
  while (variants != nullptr) {
    if (variants->find(name) != nullptr) return table_of(*variants, name);
    const auto cut = name.rfind('_');
    if (cut == std::string::npos) return nullptr;
    name.resize(cut);
  }
  return nullptr;
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
      if (TomlTable* variant = variant_for(variants, name)) lay_over(root, *variant, where);
    }
  }
  for (const auto& change : overrides)
    if (!is_of_variant(change)) apply_override(root, change, problems);
}

void check_variants(TableReader reader, const CycleSettings& cycle, Problems& problems) {
  for (const auto* entry : reader.entries()) check_variant(*entry, cycle, problems);
}

}  // namespace smoothpost::machine_file
