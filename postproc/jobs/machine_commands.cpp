#include "postproc/jobs/machine_commands.h"

#include <algorithm>
#include <filesystem>
#include <map>

#include "kernels/core/units.h"
#include "machines/dialects/decimal.h"
#include "postproc/jobs/files.h"
#include "postproc/jobs/fit_command.h"
#include "postproc/jobs/import_command.h"
#include "postproc/jobs/settings.h"
#include "postproc/pipeline/registry.h"
#include "postproc/pipeline/test_program.h"

namespace smoothpost {

namespace fs = std::filesystem;

namespace {

JobResult usage(std::string text) {
  JobResult result;
  result.status = ExitStatus::usage;
  result.diagnostics.push_back(usage_error("US104", std::move(text)));
  return result;
}

void add_number(std::string& text, double value, const char* unit) {
  append_decimal(text, value, 4);
  text += unit;
}

std::string axis_line(const AxisDefinition& axis) {
  const bool rotary = axis.joint.kind == JointKind::rotary;
  const double scale = rotary ? kDegreesPerRadian : 1.0;
  std::string text = "  " + axis.name + " (word " + std::string(1, axis.letter) + "): ";
  text += rotary ? "rotary" : "linear";
  text += axis.joint.side == ChainSide::tool ? ", moves the tool, " : ", moves the workpiece, ";
  text += "direction";
  for (int i = 0; i < 3; ++i) {
    text += i ? " " : " [";
    append_decimal(text, axis.joint.direction[i], 6);
  }
  text += "], ";
  append_decimal(text, axis.joint.lower * scale, 4);
  text += " to ";
  add_number(text, axis.joint.upper * scale, rotary ? " deg, " : " mm, ");
  add_number(text, axis.velocity * scale, rotary ? " deg/s" : " mm/s");
  if (axis.joint.redundant) text += ", redundant (held)";
  return text + "\n";
}

std::string describe(const LoadedMachine& machine) {
  const MachineDefinition& m = machine.definition;
  std::string text = m.name + ": " + m.description + "\n  file " + machine.path + "\n  dialect " +
                     m.dialect.name + " (" + m.dialect.mode + " level), " + m.dialect.units + "\n";
  for (const auto& axis : m.axes) text += axis_line(axis);
  text += "  events:";
  for (const auto& e : m.process.events) text += " " + e.event + " = \"" + e.text + "\",";
  text.back() = '\n';
  return text;
}

JobResult list(const Options& options) {
  JobResult result;
  std::map<std::string, std::string> found;  // the first folder that has a name wins
  for (const auto& folder : machine_folders(options)) {
    std::error_code error;
    for (const auto& entry : fs::directory_iterator(folder, error)) {
      const fs::path file = entry.path() / "machine.toml";
      if (fs::exists(file, error)) found.emplace(entry.path().filename().string(), file.string());
    }
  }
  for (const auto& [name, file] : found) {
    const auto machine = load_machine(file, options, {});
    result.text += name + ": " +
                   (machine.ok() ? machine.value().definition.description
                                 : "not valid, see `smoothpost machines validate " + file + "`") +
                   "\n";
  }
  result.status = ExitStatus::certified;
  return result;
}

/// Makes, reads back, checks and writes the test program of a machine.
void write_test_program(const MachineDefinition& machine, const Options& options,
                        JobResult& result) {
  const auto add = [&result](const Diagnostics& list) {
    result.diagnostics.insert(result.diagnostics.end(), list.begin(), list.end());
    result.status = status_of(result.diagnostics);
  };
  const auto tools = read_tools(options.tool);
  add(tools.diagnostics());
  if (!tools.ok()) return;
  const double length = tools.value().lengths.empty() ? 0.0 : tools.value().lengths.begin()->second;
  const auto test = make_test_program(machine, length);
  add(test.diagnostics());
  if (!test.ok()) return;
  const Dialect* dialect = find_dialect(machine.dialect.name);
  const auto emitted = dialect->emit(machine, test.value().program);
  add(emitted.diagnostics());
  if (!emitted.ok()) return;
  const auto read = dialect->read_back(machine, emitted.value().text, "test program");
  add(read.diagnostics());
  if (!read.ok()) return;
  for (const Check& c : check_test_program(read.value(), machine, test.value()))
    if (!c.ok)
      add({usage_error("CK101", "check " + c.name + " of the test program failed: " + c.note)});
  if (has_error(result.diagnostics)) return;
  result.program = emitted.value().text;
  if (options.output == "-") return;
  result.program_path =
      options.output.empty() ? machine.name + "_test." + machine.dialect.extension : options.output;
  add(write_file(result.program_path, result.program));
  result.summary = "test program of machine " + machine.name + " with tool length ";
  append_decimal(result.summary, length, 3);
  result.summary += " mm: " + std::to_string(read.value().moves.size()) +
                    " slow moves, checked from its own text";
}

}  // namespace

JobResult run_machines_command(const Options& options) {
  const auto& words = options.arguments;
  if (words.empty() || words[0] == "list") return list(options);
  if (words[0] == "import") return run_import_command(options);
  if (words[0] == "fit") return run_fit_command(options);
  if (words.size() != 2 ||
      (words[0] != "show" && words[0] != "validate" && words[0] != "test-program"))
    return usage(
        "machines: list, show NAME, validate FILE, test-program NAME, import FILE or fit "
        "MEASURED.csv");
  JobResult result;
  const auto overrides = overrides_of(options);
  if (!overrides.ok()) {
    result.diagnostics = overrides.diagnostics();
    result.status = status_of(result.diagnostics);
    return result;
  }
  const auto machine = load_machine(words[1], options, overrides.value());
  result.diagnostics = machine.diagnostics();
  result.status = status_of(result.diagnostics);
  if (!machine.ok()) return result;
  if (words[0] == "show") {
    result.text = describe(machine.value());
    return result;
  }
  if (!find_dialect(machine.value().definition.dialect.name)) {
    result.diagnostics.push_back(no_dialect(machine.value().definition.dialect.name));
    result.status = ExitStatus::usage;
    return result;
  }
  if (words[0] == "test-program") {
    write_test_program(machine.value().definition, options, result);
    return result;
  }
  result.text = machine.value().path + ": valid, machine " + machine.value().definition.name +
                " with " + std::to_string(machine.value().definition.size()) + " axes\n";
  return result;
}

JobResult run_formats_command(const Options& options) {
  if (!options.arguments.empty()) return usage("formats takes no further words");
  JobResult result;
  result.text = "input formats (--input-format):\n";
  for (const auto& f : input_formats())
    result.text +=
        "  " + std::string(f.name) + ": " + f.description + "; extensions: " + f.extensions + "\n";
  result.text += "output dialects (--dialect):\n";
  for (const auto& d : dialects())
    result.text += "  " + std::string(d.name) + ": " + d.description + "\n";
  result.status = ExitStatus::certified;
  return result;
}

}  // namespace smoothpost
