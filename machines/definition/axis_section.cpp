#include <algorithm>
#include <optional>

#include "kernels/core/canonical_motion.h"
#include "kernels/core/units.h"
#include "machines/definition/sections.h"

namespace smoothpost::machine_file {

namespace {

std::string title_of(const TomlValue& item) {
  std::string title = "[[axis]]";
  const auto text = [&](const char* key) -> std::string {
    const TomlEntry* entry = item.table.find(key);
    if (entry == nullptr || entry->value.kind != TomlKind::string) return "";
    return entry->value.string.substr(0, 64);
  };
  const std::string type = text("type");
  if (type == "linear" || type == "rotary") title = type + " axis";
  const std::string name = text("name");
  return name.empty() ? title : title + " " + name;
}

struct FileUnit {
  std::string suffix;  ///< of the keys
  double scale = 1.0;  ///< file unit to mm or rad
};

/// Position range in the file's unit; nothing when it is missing or wrong.
struct Range {
  double lower = 0.0;
  double upper = 0.0;
};

std::optional<Range> read_range(TableReader& reader, const FileUnit& unit) {
  const std::string min_key = "min_" + unit.suffix;
  const std::string max_key = "max_" + unit.suffix;
  const auto lower = reader.required().number(min_key);
  const auto upper = reader.required().number(max_key);
  if (!lower || !upper) return std::nullopt;
  if (*lower < *upper) return Range{*lower, *upper};
  reader.error("MF110",
               reader.title() + ": " + min_key + " " + to_text(*lower) + " is not below " +
                   max_key + " " + to_text(*upper),
               blame(reader, {min_key, max_key}));
  return std::nullopt;
}

void read_home(TableReader& reader, const FileUnit& unit, const std::optional<Range>& range,
               AxisDefinition& axis) {
  const auto home = reader.number("home");
  axis.joint.home = home.value_or(0.0) * unit.scale;
  if (!range) return;
  axis.joint.lower = range->lower * unit.scale;
  axis.joint.upper = range->upper * unit.scale;
  const double value = home.value_or(0.0);
  if (value >= range->lower && value <= range->upper) return;
  const std::string text =
      to_text(range->lower) + " to " + to_text(range->upper) + " " + unit.suffix;
  if (home)
    reader.error("MF115", "home " + to_text(value) + " is outside the range " + text,
                 blame(reader, {"min_" + unit.suffix, "max_" + unit.suffix, "home"}));
  else if (!reader.has("home"))
    reader.error("MF115", reader.title() + " needs a home: 0 is outside its range " + text,
                 blame_table(reader, {"min_" + unit.suffix, "max_" + unit.suffix}));
}

void read_limits(TableReader& reader, const FileUnit& unit, AxisDefinition& axis) {
  const auto limit = [&](const std::string& stem, const std::string& per) {
    const std::string key = stem + unit.suffix + per;
    return reader.required().number(key, Bound::positive).value_or(1.0) * unit.scale;
  };
  axis.velocity = limit("max_velocity_", "_per_s");
  axis.acceleration = limit("max_acceleration_", "_per_s2");
  axis.jerk = limit("max_jerk_", "_per_s3");
}

/// An axis without a type: its keys are known in both units, so that only the type is reported.
void accept_both_units(TableReader& reader) {
  for (const std::string unit : {"mm", "deg"}) {
    for (const std::string stem : {"min_", "max_"}) reader.entry(stem + unit);
    reader.entry("max_velocity_" + unit + "_per_s");
    reader.entry("max_acceleration_" + unit + "_per_s2");
    reader.entry("max_jerk_" + unit + "_per_s3");
  }
  for (const char* key : {"origin_mm", "home", "cyclic"}) reader.entry(key);
}

void read_by_type(TableReader& reader, AxisDefinition& axis) {
  const auto type = reader.required().choice("type", {"linear", "rotary"});
  if (!type) {
    accept_both_units(reader);
    return;
  }
  const bool rotary = *type == "rotary";
  axis.joint.kind = rotary ? JointKind::rotary : JointKind::linear;
  const FileUnit unit{rotary ? "deg" : "mm", rotary ? kRadiansPerDegree : 1.0};
  if (rotary) {
    axis.joint.origin = reader.required().vector("origin_mm").value_or(Vec3::Zero());
    axis.joint.cyclic = reader.boolean("cyclic").value_or(false);
  }
  read_home(reader, unit, read_range(reader, unit), axis);
  read_limits(reader, unit, axis);
}

SourceLocation place_of(const TomlValue& item, const char* key) {
  const TomlEntry* entry = item.table.find(key);
  return entry != nullptr ? entry->value.where : item.where;
}

std::string line_text(const SourceLocation& where) {
  return where.line > 0 ? "line " + std::to_string(where.line) : where.file;
}

void check_letter(const AxisDefinition& axis, const TomlValue& item, const std::string& dialect,
                  Problems& problems) {
  if (dialect != "linuxcnc") return;
  const bool rotary = axis.joint.kind == JointKind::rotary;
  const std::string_view letters = rotary ? "ABC" : "XYZUVW";
  if (letters.find(axis.letter) != std::string_view::npos) return;
  problems.error("MF118",
                 std::string(rotary ? "rotary" : "linear") + " axis " + axis.name +
                     " has the letter " + std::string(1, axis.letter) + ": dialect linuxcnc has " +
                     std::string(letters) + " for it",
                 place_of(item, "letter"));
}

}  // namespace

AxisDefinition read_axis(const TomlValue& item, Problems& problems) {
  TableReader reader(&item.table, title_of(item), item.where, problems);
  AxisDefinition axis;
  axis.letter = '\0';
  if (const auto name = reader.required().text("name")) {
    axis.name = *name;
    if (!is_name(*name))
      reader.error("MF113", "an axis name is a letter, then letters, digits or _", "name");
    if (*name == "base" || *name == "workpiece")
      reader.error("MF112", *name + " is a link of every machine: give the axis another name",
                   "name");
  }
  if (const auto letter = reader.required().text("letter")) {
    if (letter->size() == 1 && (*letter)[0] >= 'A' && (*letter)[0] <= 'Z')
      axis.letter = (*letter)[0];
    else
      reader.error("MF113", "letter has to be one capital letter, such as \"X\"", "letter");
  }
  const auto chain = reader.required().choice("chain", {"tool", "workpiece"});
  axis.joint.side = chain == "workpiece" ? ChainSide::workpiece : ChainSide::tool;
  axis.joint.direction = reader.required().direction("direction").value_or(Vec3::UnitX());
  read_by_type(reader, axis);
  axis.joint.redundant = reader.boolean("redundant").value_or(false);
  const auto source = reader.choice("source", {"datasheet", "measured", "assumed"});
  if (source == "datasheet") axis.source = LimitSource::datasheet;
  if (source == "measured") axis.source = LimitSource::measured;
  reader.finish();
  return axis;
}

void check_axes(const std::vector<AxisDefinition>& axes, const std::vector<const TomlValue*>& items,
                const std::string& dialect, Problems& problems) {
  for (std::size_t i = 0; i < axes.size(); ++i) {
    for (std::size_t j = 0; j < i; ++j) {
      if (!axes[i].name.empty() && axes[i].name == axes[j].name)
        problems.error(
            "MF112",
            "axis name " + axes[i].name + " is taken: " + line_text(place_of(*items[j], "name")),
            place_of(*items[i], "name"));
      if (axes[i].letter != '\0' && axes[i].letter == axes[j].letter)
        problems.error("MF112",
                       "letter " + std::string(1, axes[i].letter) + " is taken by axis " +
                           axes[j].name + ": " + line_text(place_of(*items[j], "letter")),
                       place_of(*items[i], "letter"));
    }
    const bool typed = items[i]->table.find("type") != nullptr;
    if (typed && axes[i].letter != '\0') check_letter(axes[i], *items[i], dialect, problems);
  }
}

}  // namespace smoothpost::machine_file
