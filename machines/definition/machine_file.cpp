#include "machines/definition/machine_file.h"

#include <algorithm>
#include <filesystem>
#include <optional>
#include <set>
#include <utility>

#include "machines/definition/sections.h"

namespace smoothpost {

namespace machine_file {

bool is_name(std::string_view name, bool dash) {
  const auto letter = [](char c) { return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z'); };
  const auto digit = [](char c) { return c >= '0' && c <= '9'; };
  if (name.empty() || (!dash && !letter(name.front()))) return false;
  return std::all_of(name.begin(), name.end(), [&](char c) {
    return letter(c) || digit(c) || c == '_' || (dash && c == '-');
  });
}

SourceLocation blame(const TableReader& reader, const std::vector<std::string>& keys) {
  SourceLocation last = reader.where();
  for (const auto& key : keys) {
    if (!reader.has(key)) continue;
    last = reader.where(key);
    if (last.line == 0) return last;
  }
  return last;
}

SourceLocation blame_table(const TableReader& reader, const std::vector<std::string>& keys) {
  const SourceLocation place = blame(reader, keys);
  return place.line == 0 ? place : reader.where();
}

namespace {

constexpr std::size_t kMaxBodies = 1000;

void read_schema(TableReader& root, bool needed) {
  if (needed && !root.has("schema")) {
    root.error("MF103", "no schema: begin the file with schema = 1", "schema");
    root.entry("schema");
    return;
  }
  const TomlEntry* entry = root.entry("schema");
  if (entry == nullptr) return;
  if (entry->value.kind != TomlKind::integer || entry->value.integer != 1)
    root.error("MF103", "this version reads schema = 1 only", "schema");
}

class Reader {
 public:
  Reader(const TomlTable& tree, const std::string& file, Problems& problems)
      : root_(&tree, "a machine file", {file, 1, 1}, problems), problems_(problems) {}

  MachineDefinition read() {
    MachineDefinition machine;
    read_schema(root_, true);
    if (const auto name = root_.required().text("name")) {
      machine.name = *name;
      if (!is_name(*name, true))
        root_.error("MF113", "a machine's name is letters, digits, _ and -", "name");
    }
    machine.description = root_.text("description").value_or("");
    const auto items = read_axes(machine);
    machine.tool = read_tool(root_.table("tool", "[tool]"));
    machine.workpiece = read_workpiece(root_.table("workpiece", "[workpiece]"));
    machine.cycle = read_cycle(root_.table("cycle", "[cycle]"));
    machine.standoff = read_standoff(root_.table("standoff", "[standoff]"), machine.axes);
    machine.links = read_links(root_.table("links", "[links]"), machine.axes);
    machine.recipe = read_recipe(root_.table("recipe", "[recipe]"));
    machine.tolerance = read_tolerance(root_.table("tolerance", "[tolerance]"), machine.recipe);
    read_bodies(machine);
    machine.collision = read_collision(root_.table("collision", "[collision]"), machine, problems_);
    machine.dialect = read_dialect(root_.table("dialect", "[dialect]"), machine.cycle);
    check_axes(machine.axes, items, machine.dialect.name, problems_);
    TableReader process = root_.table("process", "[process]");
    machine.process = read_process(process, problems_);
    if (process.has("power")) machine.power = read_power(process.table("power", "[process.power]"));
    process.entry("power");
    process.finish();
    if (root_.has("variant"))
      check_variants(root_.table("variant", "[variant]"), machine.cycle, problems_);
    root_.entry("variant");
    root_.finish();
    return machine;
  }

 private:
  std::vector<const TomlValue*> read_axes(MachineDefinition& machine) {
    auto items = root_.required().tables("axis");
    const TomlEntry* axis = root_.entry("axis");
    const bool is_list = axis != nullptr && axis->value.kind == TomlKind::array;
    if (is_list && axis->value.items.empty())
      root_.error("MF119", "the machine has no axis: add one [[axis]] per joint", "axis");
    if (items.size() > static_cast<std::size_t>(kMaxJoints)) {
      problems_.error("MF119",
                      "the machine has " + std::to_string(items.size()) + " axes; at most " +
                          std::to_string(kMaxJoints) + " can be used",
                      items[kMaxJoints]->where);
      items.resize(kMaxJoints);
    }
    for (const auto* item : items) machine.axes.push_back(read_axis(*item, problems_));
    return items;
  }

  void read_bodies(MachineDefinition& machine) {
    auto items = root_.tables("body");
    if (items.size() > kMaxBodies) {
      problems_.error("MF119",
                      "the machine has " + std::to_string(items.size()) + " bodies; at most " +
                          std::to_string(kMaxBodies) + " can be used",
                      items[kMaxBodies]->where);
      items.resize(kMaxBodies);
    }
    const BodyContext context{
        machine.axes, machine.tolerance.clearance,
        std::filesystem::path(root_.where().file).parent_path().generic_string()};
    std::set<std::string> names;
    for (const auto* item : items) {
      Body body = read_body(*item, context, problems_);
      const TomlEntry* name = item->table.find("name");
      if (name != nullptr && !body.name.empty() && !names.insert(body.name).second)
        problems_.error("MF112", "body name " + body.name.substr(0, 64) + " is taken",
                        name->value.where);
      machine.bodies.push_back(std::move(body));
    }
  }

  TableReader root_;
  Problems& problems_;
};

template <class T>
Result<T> finished(T value, Problems& problems) {
  const bool failed = problems.any_error();
  Diagnostics diagnostics = problems.take();
  if (failed) return Result<T>::failure(std::move(diagnostics));
  return {std::move(value), std::move(diagnostics)};
}

}  // namespace

}  // namespace machine_file

Result<MachineDefinition> parse_machine_file(std::string_view text, const std::string& file_name,
                                             const std::vector<MachineOverride>& overrides) {
  auto tree = parse_toml(text, file_name);
  if (!tree.ok()) return Result<MachineDefinition>::failure(tree.diagnostics());
  machine_file::Problems problems;
  machine_file::choose_dialect(tree.value(), overrides, problems);
  MachineDefinition machine = machine_file::Reader(tree.value(), file_name, problems).read();
  return machine_file::finished(std::move(machine), problems);
}

Result<ProcessTable> parse_process_file(std::string_view text, const std::string& file_name) {
  const auto tree = parse_toml(text, file_name);
  if (!tree.ok()) return Result<ProcessTable>::failure(tree.diagnostics());
  machine_file::Problems problems;
  machine_file::TableReader root(&tree.value(), "a process file", {file_name, 1, 1}, problems);
  machine_file::read_schema(root, false);
  machine_file::TableReader process = root.required().table("process", "[process]");
  ProcessTable table = machine_file::read_process(process, problems);
  process.finish();
  root.finish();
  return machine_file::finished(std::move(table), problems);
}

}  // namespace smoothpost
