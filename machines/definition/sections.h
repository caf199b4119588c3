#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "machines/definition/machine.h"
#include "machines/definition/machine_file.h"
#include "machines/definition/table_reader.h"

// The sections of a machine file, one function each: file units in, mm, rad and s out. Internal to
// machines/definition. Each reports everything that is wrong with its table, also against the axes
// that were read before it, and returns what it could read.
namespace smoothpost::machine_file {

AxisDefinition read_axis(const TomlValue& item, Problems& problems);
/// Duplicate names and letters, and letters that the dialect does not have.
void check_axes(const std::vector<AxisDefinition>& axes, const std::vector<const TomlValue*>& items,
                const std::string& dialect, Problems& problems);

ToolDefinition read_tool(TableReader reader);
WorkpieceDefinition read_workpiece(TableReader reader);

/// What a [[body]] refers to.
struct BodyContext {
  const std::vector<AxisDefinition>& axes;
  double clearance = 0.0;  ///< mm, of bodies that state none
  std::string folder;      ///< of the machine file: where the paths of meshes start
};
Body read_body(const TomlValue& item, const BodyContext& context, Problems& problems);
CollisionSettings read_collision(TableReader reader, const MachineDefinition& machine,
                                 Problems& problems);
CycleSettings read_cycle(TableReader reader);
StandoffSettings read_standoff(TableReader reader, const std::vector<AxisDefinition>& axes);
LinkSettings read_links(TableReader reader, const std::vector<AxisDefinition>& axes);
/// The default shares of the tolerances follow from what the recipe does.
ToleranceSettings read_tolerance(TableReader reader, const RecipeSettings& recipe);
RecipeSettings read_recipe(TableReader reader);
DialectSettings read_dialect(TableReader reader, const CycleSettings& cycle);

/// [process] without [process.power], which only machine files have.
ProcessTable read_process(TableReader& reader, Problems& problems);
PowerTable read_power(TableReader reader);

/// Changes one value of the tree. Everything it puts there is located as `--set <key>`.
void apply_override(TomlTable& root, const MachineOverride& change, Problems& problems);

/// Applies all overrides, and makes [dialect] and [process] those of the dialect that they choose.
/// When that is not the file's own, its [variant.NAME] is laid over them: keys of `dialect` one by
/// one, `process` as a whole (the power table stays unless it has one). Nothing of the file's own
/// controller is left: events, start and end lines and extension come from the variant or are none
/// (extension: the dialect's usual one). What was taken is gone from [variant.NAME].
void choose_dialect(TomlTable& root, const std::vector<MachineOverride>& overrides,
                    Problems& problems);

/// Checks what stands in [variant] and was not taken.
void check_variants(TableReader reader, const CycleSettings& cycle, Problems& problems);

/// Where to point when several keys are wrong together: the first that an override has set, else
/// the last.
SourceLocation blame(const TableReader& reader, const std::vector<std::string>& keys);

/// The same for what is wrong with a table as a whole: the first that an override has set, else the
/// table.
SourceLocation blame_table(const TableReader& reader, const std::vector<std::string>& keys);

/// Letters, digits, `_` and, with `dash`, `-`; not empty; the first is a letter unless `dash`.
bool is_name(std::string_view name, bool dash = false);

}  // namespace smoothpost::machine_file
