#include <algorithm>
#include <array>
#include <cmath>

#include "kernels/core/units.h"
#include "machines/import/imported_machine.h"

namespace smoothpost {

namespace {

constexpr std::string_view kLetters = "XYZABCUVW";
constexpr std::string_view kRotary = "ABC";
constexpr double kFullTurn = 360.0 * kRadiansPerDegree;
constexpr double kLongTravel = 1000.0;  // mm either way, where the INI has no limit

/// [KINS]KINEMATICS: the module and its parameters.
struct Module {
  std::string name;
  std::string coordinates;  ///< capital letters, by joint
  SourceLocation where;
};

class Importer {
 public:
  Importer(const ini::File& file, const std::string& name, const ini::Source& files,
           const ImportWords& said)
      : ini_(file), file_(name), files_(files), said_(said) {}

  Result<ImportedMachine> run() {
    ImportedMachine m;
    if (read_module() && read_units()) {
      read_hal();
      make(m);
    }
    if (!has_error(diagnostics_)) {
      const Diagnostics faults = check_imported(m, file_);
      diagnostics_.insert(diagnostics_.end(), faults.begin(), faults.end());
    }
    if (has_error(diagnostics_)) return Result<ImportedMachine>::failure(std::move(diagnostics_));
    return {std::move(m), std::move(diagnostics_)};
  }

 private:
  void error(const char* code, std::string text, const SourceLocation& where) {
    if (diagnostics_.size() < 50)
      diagnostics_.push_back({Severity::error, code, std::move(text), where});
  }
  void warning(const char* code, std::string text, const SourceLocation& where) {
    diagnostics_.push_back({Severity::warning, code, std::move(text), where});
  }

  bool read_module() {
    const ini::Entry* kins = ini_.find("KINS", "KINEMATICS");
    const auto part = kins == nullptr ? std::vector<std::string>() : ini::words(kins->value);
    if (part.empty()) {
      error("MF203",
            "no [KINS]KINEMATICS: a configuration of LinuxCNC 2.8 or later is read (`update_ini` "
            "makes one of an older file)",
            {file_, 0, 0});
      return false;
    }
    module_.name = part[0];
    module_.where = kins->where;
    for (const auto& word : part) {
      if (word.rfind("coordinates=", 0) != 0) continue;
      for (const char c : word.substr(12)) module_.coordinates += upper(c);
    }
    return true;
  }

  static char upper(char c) { return c >= 'a' && c <= 'z' ? static_cast<char>(c - 32) : c; }

  bool read_units() {
    const ini::Entry* linear = ini_.find("TRAJ", "LINEAR_UNITS");
    const ini::Entry* angular = ini_.find("TRAJ", "ANGULAR_UNITS");
    const auto first = [](const ini::Entry* e) {
      const auto w = e == nullptr ? std::vector<std::string>() : ini::words(e->value);
      return w.empty() ? std::string() : w[0];
    };
    const std::string length = first(linear), angle = first(angular);
    if (length == "mm" || length == "metric")
      millimetres_ = 1.0;
    else if (length == "inch" || length == "in" || length == "imperial")
      millimetres_ = kMillimetresPerInch;
    else
      error("MF202", "[TRAJ]LINEAR_UNITS \"" + length + "\": mm or inch is read",
            linear == nullptr ? SourceLocation{file_, 0, 0} : linear->where);
    if (!angle.empty() && angle != "deg" && angle != "degree" && angle != "degrees")
      error("MF202", "[TRAJ]ANGULAR_UNITS \"" + angle + "\": degree is read", angular->where);
    return !has_error(diagnostics_);
  }

  void read_hal() {
    const ini::Section* hal = ini_.find("HAL");
    if (hal == nullptr) return;
    int read = 0;
    for (const ini::Entry& e : hal->entries) {
      if (e.key == "HALCMD") hal_.add(e.value, e.where.file, e.where.line, ini_);
      if (e.key != "HALFILE" && e.key != "POSTGUI_HALFILE") continue;
      const auto name = ini::words(e.value);
      if (name.empty() || name[0].rfind("LIB:", 0) == 0) continue;
      const bool script = name[0].size() > 4 && name[0].substr(name[0].size() - 4) == ".tcl";
      const auto text =
          script || ++read > ini::kMaxFiles || !files_ ? std::nullopt : files_(name[0]);
      if (text)
        hal_.add(std::string_view(*text).substr(0, ini::kMaxBytes), name[0], 1, ini_);
      else
        warning("MF207",
                name[0] + (script ? " is a script: what it sets is not read"
                                  : " is not there or outside of the folder of the INI file"),
                e.where);
    }
  }

  void make(ImportedMachine& m) {
    const ini::Entry* title = ini_.find("EMC", "MACHINE");
    m.name = title == nullptr ? "linuxcnc" : title->value;
    m.description = "imported from a LinuxCNC configuration, kinematics " + module_.name;
    m.dialect = "linuxcnc";
    m.units = millimetres_ == 1.0 ? "mm" : "inch";
    m.events = {"spindle_on = { text = \"M3 S{rpm}\", motion = \"stop\" }",
                "spindle_on_reverse = { text = \"M4 S{rpm}\", motion = \"stop\" }",
                "spindle_off = { text = \"M5\", motion = \"stop\" }",
                "coolant_on = { text = \"M8\", motion = \"stop\" }",
                "coolant_mist = { text = \"M7\", motion = \"stop\" }",
                "coolant_off = { text = \"M9\", motion = \"stop\" }",
                "tool_change = { text = \"T{tool} M6\", motion = \"stop\" }",
                "stop = { text = \"M0\", motion = \"stop\" }",
                "message = { text = \"(MSG, {text})\", motion = \"on_the_fly\" }"};
    if (module_.name == "trivkins") return trivial(m);
    if (module_.name == "xyzac-trt-kins") return trunnion(m, 'A');
    if (module_.name == "xyzbc-trt-kins") return trunnion(m, 'B');
    if (module_.name == "5axiskins") return bridge(m);
    if (module_.name == "genserkins") return serial(m);
    error("MF202",
          "kinematics " + module_.name.substr(0, 64) +
              " is not read: trivkins, xyzac-trt-kins, xyzbc-trt-kins, 5axiskins and genserkins "
              "are. Write the machine file by hand (docs/how_to/add_a_machine.md)",
          module_.where);
  }

  /// The tightest of what the sections of an axis say.
  void limits(ImportedAxis& axis, const std::vector<std::string>& sections) {
    const bool rotary = axis.kind == JointKind::rotary;
    const double scale = rotary ? kRadiansPerDegree : millimetres_;
    std::optional<double> lower, upper;
    const auto tighten = [](std::optional<double>& into, std::optional<double> value, bool least) {
      if (value) into = !into ? *value : least ? std::min(*into, *value) : std::max(*into, *value);
    };
    for (const std::string& section : sections) {
      const auto get = [&](const char* key) { return number(section, key, scale); };
      tighten(lower, get("MIN_LIMIT"), false);
      tighten(upper, get("MAX_LIMIT"), true);
      tighten(axis.velocity, positive(get("MAX_VELOCITY")), true);
      tighten(axis.acceleration, positive(get("MAX_ACCELERATION")), true);
      tighten(axis.jerk, positive(get("MAX_JERK")), true);
      if (section[0] == 'J') axis.home = get("HOME");
    }
    const double far = rotary ? kFullTurn : kLongTravel;
    axis.lower =
        lower ? ImportedNumber{*lower, {}} : ImportedNumber{-far, "the INI has no MIN_LIMIT"};
    axis.upper =
        upper ? ImportedNumber{*upper, {}} : ImportedNumber{far, "the INI has no MAX_LIMIT"};
  }

  static std::optional<double> positive(std::optional<double> v) {
    return v && *v > 0.0 ? v : std::nullopt;
  }

  std::optional<double> number(const std::string& section, const char* key, double scale) {
    const ini::Entry* entry = ini_.find(section, key);
    if (entry == nullptr) return std::nullopt;
    if (const auto value = ini::leading_number(entry->value)) return *value * scale;
    error("MF203", "[" + section + "]" + key + " = " + entry->value.substr(0, 64) + " is no number",
          entry->where);
    return std::nullopt;
  }

  int joint_count(int fallback) {
    const auto count = number("KINS", "JOINTS", 1.0);
    if (!count || !(*count >= 1.0) || !(*count <= 16.0)) return fallback;
    return static_cast<int>(*count);
  }

  /// An axis by its letter, with the limits of all joints that it has.
  std::optional<ImportedAxis> lettered(char letter, const std::string& coordinates) {
    ImportedAxis axis;
    axis.name = std::string(1, letter);
    axis.letter = letter;
    axis.kind =
        kRotary.find(letter) == std::string_view::npos ? JointKind::linear : JointKind::rotary;
    std::vector<std::string> sections = {"AXIS_" + axis.name};
    for (std::size_t j = 0; j < coordinates.size(); ++j) {
      if (coordinates[j] != letter) continue;
      const std::string joint = "JOINT_" + std::to_string(j);
      if (const ini::Entry* type = ini_.find(joint, "TYPE"))
        if ((type->value.rfind("ANGULAR", 0) == 0) != (axis.kind == JointKind::rotary)) {
          error("MF202",
                "[" + joint + "]TYPE = " + type->value.substr(0, 32) + " of axis " + axis.name +
                    ": rotary axes are A, B, C, the others are linear",
                type->where);
          return std::nullopt;
        }
      sections.push_back(joint);
      axis.comment += (axis.comment.empty() ? "joint " : " and ") + std::to_string(j);
    }
    if (sections.size() == 1) {
      error("MF203", "no joint has the letter " + axis.name, module_.where);
      return std::nullopt;
    }
    limits(axis, sections);
    return axis;
  }

  static Vec3 along(char letter) {
    switch (letter) {
      case 'X':
      case 'U':
      case 'A':
        return Vec3::UnitX();
      case 'Y':
      case 'V':
      case 'B':
        return Vec3::UnitY();
      default:
        return Vec3::UnitZ();
    }
  }

  bool letters_are(const std::string& coordinates, std::string_view needed) {
    for (const char c : coordinates)
      if (kLetters.find(c) == std::string_view::npos) {
        error("MF202", std::string("coordinates= has the letter ") + (c < ' ' ? '?' : c),
              module_.where);
        return false;
      }
    for (const char c : needed)
      if (coordinates.find(c) == std::string::npos) {
        error("MF203",
              std::string("coordinates= lacks ") + c + ", which " + module_.name + " needs",
              module_.where);
        return false;
      }
    return true;
  }

  std::string trivial_coordinates() {
    if (!module_.coordinates.empty()) return module_.coordinates;
    const auto count = std::min<std::size_t>(9, static_cast<std::size_t>(joint_count(9)));
    return std::string(kLetters.substr(0, count));
  }

  void trivial(ImportedMachine& m) {
    const std::string coordinates = trivial_coordinates();
    if (!letters_are(coordinates, "")) return;
    std::string unplaced;
    for (const char letter : std::string("XYZUVW")) {
      if (coordinates.find(letter) == std::string::npos) continue;
      auto axis = lettered(letter, coordinates);
      if (!axis) return;
      axis->direction = along(letter);
      if (letter >= 'U' && letter <= 'W') {
        axis->redundant = true;
        axis->direction_note = "parallel to X, Y, Z as its letter says";
      }
      m.axes.push_back(std::move(*axis));
    }
    for (const char letter : rotary_order(coordinates)) add_placed(letter, coordinates, m);
    for (const char letter : kRotary) {
      if (coordinates.find(letter) == std::string::npos) continue;
      if (said_.count(std::string(1, letter)) == 0) unplaced += letter;
    }
    if (!unplaced.empty())
      error("MF205",
            "trivkins does not say where the rotary axes " + unplaced +
                " are: say for each, base outwards, such as " + unplaced.substr(0, 1) +
                "=table or " + unplaced.substr(0, 1) + "=head",
            module_.where);
  }

  /// Rotaries in the order of order=A,C, else by letter.
  std::string rotary_order(const std::string& coordinates) const {
    std::string out;
    const auto take = [&](char c) {
      if (kRotary.find(c) != std::string_view::npos && coordinates.find(c) != std::string::npos &&
          out.find(c) == std::string::npos && said_.count(std::string(1, c)) != 0)
        out += c;
    };
    if (const auto order = said_.find("order"); order != said_.end())
      for (const char c : order->second) take(upper(c));
    for (const char c : kRotary) take(c);
    return out;
  }

  void add_placed(char letter, const std::string& coordinates, ImportedMachine& m) {
    const std::string& place = said_.at(std::string(1, letter));
    if (place != "table" && place != "head")
      return error(
          "MF205",
          std::string(1, letter) + "=" + place.substr(0, 32) + ": table or head is expected",
          module_.where);
    auto axis = lettered(letter, coordinates);
    if (!axis) return;
    axis->side = place == "table" ? ChainSide::workpiece : ChainSide::tool;
    axis->direction = along(letter);
    axis->direction_note = "the " + place + " turns by the right hand rule; test-program shows it";
    axis->origin_note = "measure it: docs/how_to/fit_a_machine.md";
    m.axes.push_back(std::move(*axis));
  }

  /// The value of a pin of the kinematics module; `fallback` is what the module has when nothing
  /// sets it. mm from the unit of the machine.
  double pin(const std::string& name, double fallback, std::string& note) {
    const std::string full = module_.name + "." + name;
    const ini::PinValue value = hal_.pin(full);
    if (value.kind == ini::PinValue::Kind::number) return value.value * millimetres_;
    if (value.kind == ini::PinValue::Kind::unset) {
      if (fallback != 0.0) note += (note.empty() ? "" : "; ") + full + " is set nowhere";
      return fallback;
    }
    note += (note.empty() ? "" : "; ") + full + " comes from " + value.text.substr(0, 64);
    return fallback;
  }

  /// Joints = R(tilt)·R(C)·(tip − r) …: the tilting axis passes r + d, the table's r.
  void trunnion(ImportedMachine& m, char tilt) {
    const std::string coordinates =
        module_.coordinates.empty() ? (tilt == 'A' ? "XYZAC" : "XYZBC") : module_.coordinates;
    if (!letters_are(coordinates, tilt == 'A' ? "XYZAC" : "XYZBC")) return;
    std::string table_note, tilt_note;
    const Vec3 r(pin("x-rot-point", 0.0, table_note), pin("y-rot-point", 0.0, table_note),
                 pin("z-rot-point", 0.0, table_note));
    Vec3 d(0.0, 0.0, pin("z-offset", 0.0, tilt_note));
    (tilt == 'A' ? d.y() : d.x()) = pin(tilt == 'A' ? "y-offset" : "x-offset", 0.0, tilt_note);
    for (const char letter : {'X', 'Y', 'Z', tilt, 'C'}) {
      auto axis = lettered(letter, coordinates);
      if (!axis) return;
      axis->direction = along(letter);
      if (axis->kind == JointKind::rotary) {
        axis->side = ChainSide::workpiece;
        axis->origin = letter == 'C' ? r : Vec3(r + d);
        axis->origin_note = letter == 'C' ? table_note : tilt_note;
      }
      m.axes.push_back(std::move(*axis));
    }
    extra_letters(coordinates, std::string("XYZ") + tilt + "C");
  }

  void extra_letters(const std::string& coordinates, const std::string& read) {
    std::string extra;
    for (const char c : coordinates)
      if (read.find(c) == std::string::npos && extra.find(c) == std::string::npos) extra += c;
    if (!extra.empty())
      error("MF205", "where the axes " + extra + " of " + module_.name + " are is not told",
            module_.where);
  }

  /// A fork head: C carries B, the tool hangs `pivot` below B, W lengthens it.
  void bridge(ImportedMachine& m) {
    const std::string coordinates = module_.coordinates.empty() ? "XYZBCW" : module_.coordinates;
    if (!letters_are(coordinates, "XYZBCW")) return;
    std::string note;
    const double pivot = pin("pivot-length", 250.0, note);
    if (!note.empty()) note += "; the module's own value; measure it: docs/how_to/fit_a_machine.md";
    for (const char letter : {'X', 'Y', 'Z', 'C', 'B', 'W'}) {
      auto axis = lettered(letter, coordinates);
      if (!axis) return;
      axis->direction = along(letter);
      if (letter == 'B') {
        axis->direction = -Vec3::UnitY();
        axis->origin = Vec3(0.0, 0.0, pivot);
        axis->origin_note = note;
      }
      if (letter == 'W') {
        axis->direction = -Vec3::UnitZ();
        axis->redundant = true;
      }
      m.axes.push_back(std::move(*axis));
    }
    extra_letters(coordinates, "XYZBCW");
  }

  /// Modified Denavit-Hartenberg: RotX(alpha) TransX(a) RotZ(joint) TransZ(d), joint by joint.
  void serial(ImportedMachine& m) {
    const int count = joint_count(6);
    if (count != 6)
      return error("MF202", "genserkins with " + std::to_string(count) + " joints: 6 are read",
                   module_.where);
    Pose at = Pose::Identity();
    for (int j = 0; j < count; ++j) {
      const auto a = parameter("A", j), alpha = parameter("ALPHA", j), d = parameter("D", j);
      if (!a || !alpha || !d) return;
      at = at * Eigen::AngleAxisd(*alpha, Vec3::UnitX());
      at = at * Eigen::Translation3d(*a * millimetres_, 0.0, 0.0);
      ImportedAxis axis;
      axis.name = "J" + std::to_string(j + 1);
      axis.letter = static_cast<char>('A' + j);
      axis.comment = "joint " + std::to_string(j);
      axis.kind = JointKind::rotary;
      axis.direction = at.linear().col(2);
      axis.origin = at.translation();
      limits(axis, {"JOINT_" + std::to_string(j)});
      m.axes.push_back(std::move(axis));
      at = at * Eigen::Translation3d(0.0, 0.0, *d * millimetres_);
    }
    m.kind = "robot";
    m.dialect = "ros_trajectory";
    m.units = "mm";
    m.events.clear();
    m.tip = at.translation();
    m.tool_axis = -at.linear().col(2);
    m.tool_note = "a tool of length 0 ends at the last frame and points along its Z";
    m.flange = at;
    warning("MF207",
            "this version prints no LinuxCNC programs for arms: the file has the dialect "
            "ros_trajectory",
            module_.where);
  }

  std::optional<double> parameter(const char* kind, int joint) {
    const std::string number = std::to_string(joint);
    const ini::PinValue turned = hal_.pin("genserkins.unrotate-" + number);
    if (turned.kind != ini::PinValue::Kind::unset && turned.value != 0.0) {
      error("MF202", "genserkins.unrotate-" + number + ": coupled joints are not read",
            turned.where);
      return std::nullopt;
    }
    const std::string name = std::string("genserkins.") + kind + "-" + number;
    const ini::PinValue value = hal_.pin(name);
    if (value.kind == ini::PinValue::Kind::number) return value.value;
    error("MF203", name + " has no number in the HAL files that were read",
          value.kind == ini::PinValue::Kind::unset ? module_.where : value.where);
    return std::nullopt;
  }

  const ini::File& ini_;
  std::string file_;
  const ini::Source& files_;
  const ImportWords& said_;
  ini::Hal hal_;
  Module module_;
  double millimetres_ = 1.0;
  Diagnostics diagnostics_;
};

}  // namespace

Result<ImportedMachine> import_linuxcnc(std::string_view text, const std::string& file,
                                        const ini::Source& files, const ImportWords& said) {
  const auto read = ini::read_ini(text, file, files);
  if (!read.ok()) return Result<ImportedMachine>::failure(read.diagnostics());
  auto made = Importer(read.value(), file, files, said).run();
  Diagnostics all = read.diagnostics();
  all.insert(all.end(), made.diagnostics().begin(), made.diagnostics().end());
  if (!made.ok()) return Result<ImportedMachine>::failure(std::move(all));
  return {std::move(made.value()), std::move(all)};
}

}  // namespace smoothpost
