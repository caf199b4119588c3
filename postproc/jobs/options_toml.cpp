#include "postproc/jobs/options_toml.h"

#include <algorithm>
#include <map>

#include "postproc/jobs/settings.h"

namespace smoothpost {

namespace {

const std::map<std::string, std::string Options::*>& text_options() {
  static const std::map<std::string, std::string Options::*> table = {
      {"command", &Options::command},
      {"input", &Options::input},
      {"machine", &Options::machine},
      {"machine_path", &Options::machine_path},
      {"workpiece", &Options::workpiece},
      {"workpiece_unit", &Options::workpiece_unit},
      {"output", &Options::output},
      {"dialect", &Options::dialect},
      {"input_format", &Options::input_format},
      {"input_dialect", &Options::input_dialect},
      {"integer_unit", &Options::integer_unit},
      {"input_unit", &Options::input_unit},
      {"input_feed", &Options::input_feed},
      {"cl_frames", &Options::cl_frames},
      {"cl_circles", &Options::cl_circles},
      {"run_budget", &Options::run_budget},
      {"call_depth", &Options::call_depth},
      {"input_machine", &Options::input_machine},
      {"process", &Options::process},
      {"tip_tolerance", &Options::tip_tolerance},
      {"axis_tolerance", &Options::axis_tolerance},
      {"lead", &Options::lead},
      {"tilt", &Options::tilt},
      {"smoothing", &Options::smoothing},
      {"orientation", &Options::orientation},
      {"optimise", &Options::optimise},
      {"schedule", &Options::schedule},
      {"links", &Options::links},
      {"cuts", &Options::cuts},
      {"box", &Options::box},
      {"turn", &Options::turn},
      {"against", &Options::against},
      {"json", &Options::json},
      {"report", &Options::report},
      {"plots", &Options::plots},
      {"trajectory", &Options::trajectory},
      {"line_map", &Options::line_map},
      {"pitch", &Options::pitch},
      {"depth", &Options::depth},
      {"feed", &Options::feed},
      {"rpm", &Options::rpm},
      {"from", &Options::from},
      {"to", &Options::to},
      {"lead_in", &Options::lead_in},
      {"normal_tolerance", &Options::normal_tolerance},
      {"direction", &Options::direction},
      {"stock_out", &Options::stock_out},
      {"mill", &Options::mill},
      {"steepest", &Options::steepest},
      {"contours", &Options::contours},
      {"unreachable", &Options::unreachable},
      {"scale", &Options::scale}};
  return table;
}

const std::map<std::string, std::vector<std::string> Options::*>& list_options() {
  static const std::map<std::string, std::vector<std::string> Options::*> table = {
      {"work_offset", &Options::work_offset},
      {"input_work_offset", &Options::input_work_offset},
      {"tool", &Options::tool},
      {"set", &Options::set},
      {"arguments", &Options::arguments}};
  return table;
}

const std::map<std::string, bool Options::*>& switch_options() {
  static const std::map<std::string, bool Options::*> table = {
      {"no_collision_check", &Options::no_collision_check},
      {"timings", &Options::timings},
      {"force", &Options::force},
      {"in_place", &Options::in_place}};
  return table;
}

Diagnostic wrong(const TomlEntry& entry, const std::string& what) {
  Diagnostic d = usage_error("US152", "option \"" + entry.key + "\": " + what);
  d.where = entry.where;
  return d;
}

}  // namespace

Result<Options> options_from_toml(const TomlTable& table, Options start) {
  Options options = std::move(start);
  Diagnostics errors;
  for (const auto& entry : table.entries()) {
    std::string key = entry.key;
    std::replace(key.begin(), key.end(), '-', '_');
    const auto& value = entry.value;
    if (const auto text = text_options().find(key); text != text_options().end()) {
      if (value.kind == TomlKind::string)
        options.*(text->second) = value.string;
      else
        errors.push_back(wrong(entry, "a string is expected"));
    } else if (const auto list = list_options().find(key); list != list_options().end()) {
      const bool strings =
          value.kind == TomlKind::array &&
          std::all_of(value.items.begin(), value.items.end(),
                      [](const TomlValue& item) { return item.kind == TomlKind::string; });
      (options.*(list->second)).clear();
      if (value.kind == TomlKind::string)
        (options.*(list->second)).push_back(value.string);
      else if (strings)
        for (const auto& item : value.items) (options.*(list->second)).push_back(item.string);
      else
        errors.push_back(wrong(entry, "a string or an array of strings is expected"));
    } else if (const auto flag = switch_options().find(key); flag != switch_options().end()) {
      if (value.kind == TomlKind::boolean)
        options.*(flag->second) = value.boolean;
      else
        errors.push_back(wrong(entry, "true or false is expected"));
    } else {
      errors.push_back(wrong(entry, "there is no such option"));
    }
  }
  if (!errors.empty()) return Result<Options>::failure(std::move(errors));
  return options;
}

std::string options_text(const Options& options) {
  std::string text;
  const auto add = [&text](const std::string& name, const std::string& value) {
    text += name + "=" + std::to_string(value.size()) + ":" + value + "\n";
  };
  for (const auto& [name, member] : text_options())
    if (!(options.*member).empty()) add(name, options.*member);
  for (const auto& [name, member] : list_options())
    for (const auto& item : options.*member) add(name, item);
  for (const auto& [name, member] : switch_options())
    if (options.*member) add(name, "true");
  return text;
}

void for_each_text(Options& options, const std::function<void(std::string&)>& change) {
  for (const auto& [name, member] : text_options()) change(options.*member);
  for (const auto& [name, member] : list_options())
    for (auto& item : options.*member) change(item);
}

}  // namespace smoothpost
