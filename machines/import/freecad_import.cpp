#include <algorithm>
#include <set>

#include "formats/freecad/fcm.h"
#include "kernels/core/units.h"
#include "machines/import/imported_machine.h"

namespace smoothpost {

namespace {

class Importer {
 public:
  Importer(const freecad::Machine& from, const std::string& file, const ImportWords& said)
      : from_(from), file_(file), said_(said) {}

  Result<ImportedMachine> run() {
    ImportedMachine m;
    m.name = from_.name.empty() ? "freecad" : from_.name;
    m.description =
        from_.description.empty() ? "imported from a machine of FreeCAD" : from_.description;
    m.units = from_.inch ? "inch" : "mm";
    choose_dialect(m);
    for (const bool head : {true, false})
      for (const freecad::Axis* axis : chain(head)) add_axis(*axis, m);
    m.tool_note = "a tool of length 0 ends at the origin with every axis at 0 and points down Z";
    if (!has_error(diagnostics_)) {
      const Diagnostics faults = check_imported(m, file_);
      diagnostics_.insert(diagnostics_.end(), faults.begin(), faults.end());
    }
    if (has_error(diagnostics_)) return Result<ImportedMachine>::failure(std::move(diagnostics_));
    return {std::move(m), std::move(diagnostics_)};
  }

 private:
  void error(const char* code, std::string text) {
    if (diagnostics_.size() < 50)
      diagnostics_.push_back({Severity::error, code, std::move(text), {file_, 0, 0}});
  }

  void choose_dialect(ImportedMachine& m) {
    static const std::map<std::string, std::string, std::less<>> kDialects = {
        {"linuxcnc", "linuxcnc"},    {"refactored_linuxcnc", "linuxcnc"},
        {"fanuc", "fanuc_30i"},      {"grbl", "grbl"},
        {"refactored_grbl", "grbl"}, {"heidenhain", "heidenhain"},
        {"marlin", "grbl_marlin"},   {"", "linuxcnc"}};
    const auto known = kDialects.find(from_.postprocessor);
    if (known != kDialects.end()) m.dialect = known->second;
    if (known == kDialects.end() || from_.postprocessor.empty())
      diagnostics_.push_back({Severity::warning,
                              "MF206",
                              "postprocessor \"" + from_.postprocessor +
                                  "\" tells no dialect of ours: linuxcnc is assumed",
                              {file_, 0, 0}});
  }

  const freecad::Axis* by_name(const std::string& name) const {
    for (const freecad::Axis& a : from_.axes)
      if (a.name == name) return &a;
    return nullptr;
  }

  /// The axes of one side, base outwards: linear ones first, then the rotaries by parent or by what
  /// the user says.
  std::vector<const freecad::Axis*> chain(bool head) {
    std::vector<const freecad::Axis*> out, rotaries;
    for (const freecad::Axis& a : from_.axes)
      if (a.head == head) (a.rotary ? rotaries : out).push_back(&a);
    if (rotaries.size() > 1 && !sort(rotaries)) {
      std::string names, example;
      for (const auto* a : rotaries) {
        names += (names.empty() ? "" : ", ") + a->name;
        example += (example.empty() ? "" : ",") + a->name;
      }
      error("MF205", std::string("the file names no parents for the rotary axes ") + names +
                         " of the " + (head ? "head" : "table") +
                         ": say which carries which, base outwards, such as order=" + example);
    }
    out.insert(out.end(), rotaries.begin(), rotaries.end());
    return out;
  }

  bool sort(std::vector<const freecad::Axis*>& rotaries) const {
    std::map<std::string, int> rank;
    if (const auto order = said_.find("order"); order != said_.end()) {
      std::string name;
      int next = 0;
      for (const char c : order->second + ",") {
        if (c != ',') {
          name += c;
          continue;
        }
        rank.emplace(name, next++);
        name.clear();
      }
      if (!std::all_of(rotaries.begin(), rotaries.end(),
                       [&](const auto* a) { return rank.count(a->name) != 0; }))
        return false;
    } else {
      // Number of rotaries that carry it. All have to differ.
      std::set<int> seen;
      for (const freecad::Axis* a : rotaries) {
        int depth = 0;
        const freecad::Axis* at = by_name(a->parent);
        for (std::size_t i = 0; at != nullptr && i <= from_.axes.size(); ++i) {
          depth += at->rotary ? 1 : 0;
          at = by_name(at->parent);
        }
        if (at != nullptr || !seen.insert(depth).second) return false;
        rank[a->name] = depth;
      }
    }
    std::sort(rotaries.begin(), rotaries.end(),
              [&](const auto* a, const auto* b) { return rank.at(a->name) < rank.at(b->name); });
    return true;
  }

  void add_axis(const freecad::Axis& from, ImportedMachine& m) {
    const double length = from_.inch ? kMillimetresPerInch : 1.0;
    const double scale = from.rotary ? kRadiansPerDegree : length;
    ImportedAxis axis;
    const std::string_view letters = from.rotary ? "ABC" : "XYZUVW";
    if (from.name.size() != 1 || letters.find(from.name[0]) == std::string_view::npos)
      return error("MF202", "machine.axes." + from.name + ": linear axes are X, Y, Z, U, V or W, " +
                                "rotary ones A, B or C");
    axis.name = from.name;
    axis.letter = from.name[0];
    axis.kind = from.rotary ? JointKind::rotary : JointKind::linear;
    axis.side = from.head ? ChainSide::tool : ChainSide::workpiece;
    const Vec3 direction(from.direction[0], from.direction[1], from.direction[2]);
    // Programs count as if the tool moved: a table goes the other way.
    axis.direction = from.head ? direction : Vec3(-direction);
    if (from.rotary && !from.head)
      axis.direction_note = "words turn the tool about the part, so the table turns the other way";
    if (from.rotary && from.head) axis.direction_note = "its sign; test-program shows it";
    axis.origin = length * Vec3(from.origin[0], from.origin[1], from.origin[2]);
    if (from.rotary && axis.origin.isZero())
      axis.origin_note = "all 0 in the file; measure it: docs/how_to/fit_a_machine.md";
    const double far = from.rotary ? 360.0 : 1000.0;
    axis.lower = from.lower ? ImportedNumber{*from.lower * scale, {}}
                            : ImportedNumber{-far * (from.rotary ? kRadiansPerDegree : 1.0),
                                             "the file has none"};
    axis.upper = from.upper ? ImportedNumber{*from.upper * scale, {}}
                            : ImportedNumber{far * (from.rotary ? kRadiansPerDegree : 1.0),
                                             "the file has none"};
    if (from.velocity) axis.velocity = *from.velocity * scale / kSecondsPerMinute;
    m.axes.push_back(std::move(axis));
  }

  const freecad::Machine& from_;
  std::string file_;
  const ImportWords& said_;
  Diagnostics diagnostics_;
};

}  // namespace

Result<ImportedMachine> import_freecad(std::string_view text, const std::string& file,
                                       const ImportWords& said) {
  const auto read = freecad::read_fcm(text, file);
  if (!read.ok()) return Result<ImportedMachine>::failure(read.diagnostics());
  return Importer(read.value(), file, said).run();
}

}  // namespace smoothpost
