#include "formats/freecad/fcm.h"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

namespace smoothpost::freecad {

namespace {

using nlohmann::json;

constexpr double kLargest = 1e9;
constexpr std::size_t kMostAxes = 50;
constexpr int kDeepest = 64;

class Reader {
 public:
  explicit Reader(const std::string& file) : file_(file) {}

  Result<Machine> read(std::string_view text) {
    Machine machine;
    if (text.size() > kMaxBytes)
      error("MF201", "the file is larger than 4 MiB: is it a machine of FreeCAD?");
    else
      parse(text, machine);
    if (has_error(diagnostics_)) return Result<Machine>::failure(std::move(diagnostics_));
    return {std::move(machine), std::move(diagnostics_)};
  }

 private:
  void error(const char* code, std::string text, int line = 0) {
    if (diagnostics_.size() < 50)
      diagnostics_.push_back({Severity::error, code, std::move(text), {file_, line, 0}});
  }

  static int line_of(std::string_view text, std::size_t at) {
    const auto end = static_cast<std::ptrdiff_t>(std::min(at, text.size()));
    return 1 + static_cast<int>(std::count(text.begin(), text.begin() + end, '\n'));
  }

  void parse(std::string_view text, Machine& machine) {
    bool deep = false;
    const json::parser_callback_t limit = [&deep](int depth, json::parse_event_t, json&) {
      deep = deep || depth > kDeepest;
      return !deep;
    };
    json tree;
    try {
      tree = json::parse(text.begin(), text.end(), limit);
    } catch (const json::parse_error& e) {
      return error("MF201", "not JSON", line_of(text, e.byte));
    } catch (const json::out_of_range& e) {
      // "... number overflow parsing '8E333'": what it stands for has no other name.
      const std::string_view what = e.what();
      const std::size_t begin = std::min(what.find('\''), what.size() - 1) + 1;
      const std::string_view number = what.substr(begin, what.rfind('\'') - begin);
      return error("MF201",
                   "the number " + std::string(number.substr(0, 30)) +
                       " is too large; at most 1.7e308 is read",
                   line_of(text, text.find(number)));
    }
    if (deep) return error("MF201", "the file nests deeper than 64");
    const json* root = object(tree, "machine");
    if (root == nullptr && tree.is_object() && tree.contains("axes")) root = &tree;
    const json* axes = root == nullptr ? nullptr : object(*root, "axes");
    if (axes == nullptr) return error("MF201", "not a machine of FreeCAD: no machine.axes");
    machine.name = string(*root, "name");
    machine.manufacturer = string(*root, "manufacturer");
    machine.description = string(*root, "description");
    const std::string units = string(*root, "units");
    machine.inch = units == "imperial";
    if (!units.empty() && units != "metric" && units != "imperial")
      error("MF202", "machine.units \"" + units + "\": metric or imperial is read");
    if (const json* post = object(tree, "postprocessor"))
      machine.postprocessor = string(*post, "file_name");
    if (axes->size() > kMostAxes) return error("MF201", "machine.axes has more than 50 axes");
    for (const auto& [name, axis] : axes->items()) read_axis(name.substr(0, 64), axis, machine);
    std::stable_sort(machine.axes.begin(), machine.axes.end(),
                     [](const Axis& a, const Axis& b) { return a.rotary < b.rotary; });
  }

  static const json* object(const json& parent, const char* key) {
    if (!parent.is_object()) return nullptr;
    const auto found = parent.find(key);
    return found != parent.end() && found->is_object() ? &*found : nullptr;
  }

  static std::string string(const json& parent, const char* key) {
    const auto found = parent.find(key);
    if (found == parent.end() || !found->is_string()) return {};
    return found->get_ref<const std::string&>().substr(0, 256);
  }

  void read_axis(const std::string& name, const json& from, Machine& machine) {
    const std::string path = "machine.axes." + name;
    if (!from.is_object()) return error("MF203", path + " is no object");
    Axis axis;
    axis.name = name;
    const std::string type = string(from, "type");
    axis.rotary = type == "rotary" || type == "angular";
    if (!axis.rotary && type != "linear")
      error("MF202", path + ".type \"" + type + "\": linear or rotary is read");
    const std::string role = string(from, "role");
    axis.head = role.substr(0, 5) == "head_";
    if (role != std::string(axis.head ? "head_" : "table_") + (axis.rotary ? "rotary" : "linear"))
      error("MF202", path + ".role \"" + role +
                         "\": table_linear, table_rotary, head_linear or head_rotary is read, as "
                         "the type is");
    axis.parent = string(from, "parent");
    if (const json* limits = object(from, "limits")) {
      axis.lower = number(*limits, "min", path + ".limits");
      axis.upper = number(*limits, "max", path + ".limits");
    }
    axis.velocity = number(from, "max_velocity", path);
    if (axis.velocity && !(*axis.velocity > 0.0))
      error("MF203", path + ".max_velocity is not above 0");
    read_joint(from, path, axis);
    machine.axes.push_back(std::move(axis));
  }

  std::optional<double> number(const json& parent, const char* key, const std::string& path) {
    const auto found = parent.find(key);
    if (found == parent.end() || found->is_null()) return std::nullopt;
    if (found->is_number() && std::abs(found->get<double>()) <= kLargest)
      return found->get<double>() + 0.0;
    error("MF203", path + "." + key + " is no number up to 1e9");
    return std::nullopt;
  }

  std::optional<std::array<double, 3>> vector(const json& from) {
    if (!from.is_array() || from.size() != 3) return std::nullopt;
    std::array<double, 3> out{};
    for (std::size_t i = 0; i < 3; ++i) {
      if (!from[i].is_number() || !(std::abs(from[i].get<double>()) <= kLargest))
        return std::nullopt;
      out[i] = from[i].get<double>() + 0.0;
    }
    return out;
  }

  static double length(const std::array<double, 3>& v) { return std::hypot(v[0], v[1], v[2]); }

  void read_joint(const json& from, const std::string& path, Axis& axis) {
    const auto joint = from.find("joint");
    std::optional<std::array<double, 3>> origin, direction;
    if (joint != from.end() && joint->is_object()) {
      if (joint->contains("origin")) origin = vector(joint->at("origin"));
      if (joint->contains("axis")) direction = vector(joint->at("axis"));
    } else if (joint != from.end() && joint->is_array() && joint->size() == 2) {
      // The older pair: [origin, axis], of linear axes also [axis, origin].
      origin = vector(joint->at(0));
      direction = vector(joint->at(1));
      if (!axis.rotary && origin && length(*origin) > 1e-6) std::swap(origin, direction);
    }
    if (!origin || !direction)
      return error("MF203", path + ".joint has no origin and axis of three numbers each");
    if (length(*direction) < 1e-9) return error("MF203", path + ".joint: its axis has no length");
    axis.origin = *origin;
    axis.direction = *direction;
  }

  std::string file_;
  Diagnostics diagnostics_;
};

}  // namespace

Result<Machine> read_fcm(std::string_view text, const std::string& file) {
  return Reader(file).read(text);
}

}  // namespace smoothpost::freecad
