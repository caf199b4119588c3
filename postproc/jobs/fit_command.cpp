#include "postproc/jobs/fit_command.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <map>

#include "formats/csv/number_table.h"
#include "kernels/core/units.h"
#include "kernels/optimise/chain_fit.h"
#include "machines/definition/number_edit.h"
#include "machines/dialects/decimal.h"
#include "postproc/jobs/files.h"
#include "postproc/jobs/settings.h"

namespace smoothpost {

namespace fs = std::filesystem;

namespace {

using Kind = FitParameter::Kind;

std::string decimal(double value, int digits) {
  if (!(std::abs(value) < 1e6)) return "beyond 1000000";
  std::string text;
  append_decimal(text, value, digits);
  return text;
}

double rms(const std::vector<Vec3>& residuals) {
  double sum = 0.0;
  for (const Vec3& r : residuals) sum += r.squaredNorm();
  return residuals.empty() ? 0.0 : std::sqrt(sum / static_cast<double>(residuals.size()));
}

std::size_t worst(const std::vector<Vec3>& residuals) {
  std::size_t at = 0;
  for (std::size_t i = 0; i < residuals.size(); ++i)
    if (residuals[i].norm() > residuals[at].norm()) at = i;
  return at;
}

class Fit {
 public:
  explicit Fit(const Options& options) : options_(options) {}

  JobResult run() {
    if (read_words() && load() && read_parameters() && read_readings()) fit();
    result_.status = unreadable_ ? ExitStatus::unreadable : status_of(result_.diagnostics);
    return std::move(result_);
  }

 private:
  bool fail(Diagnostic d) {
    result_.diagnostics.push_back(std::move(d));
    return false;
  }
  bool usage(const char* code, std::string text) {
    return fail(usage_error(code, std::move(text)));
  }
  bool table_error(const char* code, std::string text, int line = 0) {
    return fail({Severity::error, code, std::move(text), {table_, line, 0}});
  }
  void add(const Diagnostics& list) {
    result_.diagnostics.insert(result_.diagnostics.end(), list.begin(), list.end());
  }

  bool read_words() {
    for (std::size_t i = 1; i < options_.arguments.size(); ++i) {
      const std::string& word = options_.arguments[i];
      if (word.rfind("fit=", 0) == 0 && wanted_.empty())
        wanted_ = word.substr(4);
      else if (table_.empty())
        table_ = word;
      else
        return usage("US171", "fit: " + word + ": expected is MEASURED.csv and fit=A.origin,...");
    }
    if (table_.empty()) return usage("US171", "fit: name the table of readings, MEASURED.csv");
    if (!options_.set.empty())
      return usage("US171", "fit: --set has no meaning, the file's own numbers are fitted");
    if (options_.machine.empty())
      return usage("US101", "no machine: say -m MACHINE (`smoothpost machines list` shows them)");
    return true;
  }

  bool load() {
    auto machine = load_machine(options_.machine, options_, {});
    add(machine.diagnostics());
    if (!machine.ok()) return false;
    machine_ = std::move(machine.value());
    chain_ = chain_of(machine_.definition);
    auto bytes = read_file(table_, std::size_t{64} << 20);
    add(bytes.diagnostics());
    unreadable_ = !bytes.ok();
    if (unreadable_) return false;
    auto table = read_number_table(bytes.value(), table_);
    add(table.diagnostics());
    if (!table.ok()) return false;
    numbers_ = std::move(table.value());
    return true;
  }

  bool read_parameters() {
    if (wanted_.empty()) {
      for (int j = 0; j < chain_.size(); ++j)
        if (chain_.joints[static_cast<std::size_t>(j)].kind == JointKind::rotary)
          parameters_.push_back({Kind::origin, j});
      return !parameters_.empty() ||
             usage("US171", "fit: the machine has no rotary axis: say fit=X.direction or tool.tip");
    }
    std::string rest = wanted_ + ",";
    while (!rest.empty()) {
      const auto comma = rest.find(',');
      if (!add_parameter(rest.substr(0, comma))) return false;
      rest.erase(0, comma + 1);
    }
    return true;
  }

  bool add_parameter(const std::string& word) {
    FitParameter p{Kind::tip, -1};
    if (word != "tool.tip") {
      const auto point = word.rfind('.');
      const std::string what = point == std::string::npos ? "" : word.substr(point + 1);
      p.joint = machine_.definition.axis_by_name(word.substr(0, std::min(point, word.size())));
      const bool rotary = p.joint >= 0 && chain_.joints[static_cast<std::size_t>(p.joint)].kind ==
                                              JointKind::rotary;
      if (p.joint < 0 || (what != "direction" && !(what == "origin" && rotary)))
        return usage("US171", "fit=" + word +
                                  ": expected is AXIS.origin (of a rotary axis), AXIS.direction or "
                                  "tool.tip, AXIS as the machine file calls it");
      p.kind = what == "origin" ? Kind::origin : Kind::direction;
    }
    for (const FitParameter& other : parameters_)
      if (other.kind == p.kind && other.joint == p.joint)
        return usage("US171", "fit=" + word + " stands twice");
    parameters_.push_back(p);
    return true;
  }

  struct Columns {
    std::vector<int> axes;
    int tool = -1, sphere = -1;
    std::array<int, 3> dial{-1, -1, -1}, tip{-1, -1, -1};
  };

  /// Every column has a meaning and every axis a column.
  bool find_columns(Columns& c) {
    std::vector<std::string> known;
    const auto column = [&](std::string name) {
      known.push_back(name);
      return numbers_.column(name);
    };
    for (const AxisDefinition& axis : machine_.definition.axes) {
      const std::string name = axis.name + (axis.joint.kind == JointKind::rotary ? "_deg" : "_mm");
      c.axes.push_back(column(name));
      if (c.axes.back() < 0)
        return table_error("CSV104", "column " + name + " is missing: one for every axis");
    }
    c.tool = column("tool_mm");
    c.sphere = column("sphere");
    for (std::size_t i = 0; i < 3; ++i) {
      const std::string letter(1, "xyz"[i]);
      c.dial[i] = column("dial_" + letter + "_mm");
      c.tip[i] = column("tip_" + letter + "_mm");
    }
    for (const std::string& name : numbers_.columns)
      if (std::find(known.begin(), known.end(), name) == known.end())
        return table_error("CSV102", "unknown column `" + name +
                                         "`: axes as NAME_mm or NAME_deg, tool_mm, sphere, "
                                         "dial_x_mm, dial_y_mm, dial_z_mm, or tip_x_mm, tip_y_mm, "
                                         "tip_z_mm");
    const auto all = [](const std::array<int, 3>& list, bool there) {
      return std::all_of(list.begin(), list.end(), [&](int i) { return (i >= 0) == there; });
    };
    const bool spheres =
        c.sphere >= 0 && all(c.tip, false) && (all(c.dial, true) || all(c.dial, false));
    const bool places = c.sphere < 0 && all(c.tip, true) && all(c.dial, false);
    return spheres || places ||
           table_error(
               "CSV104",
               "either a column sphere (with or without dial_x_mm, dial_y_mm, dial_z_mm) or "
               "the three tip_x_mm, tip_y_mm, tip_z_mm");
  }

  bool read_readings() {
    Columns c;
    if (!find_columns(c)) return false;
    const auto tools = read_tools(options_.tool);
    add(tools.diagnostics());
    if (!tools.ok()) return false;
    const double length =
        tools.value().lengths.empty() ? 0.0 : tools.value().lengths.begin()->second;
    std::map<double, int> spheres;
    for (std::size_t i = 0; i < numbers_.rows.size(); ++i) {
      const auto& row = numbers_.rows[i];
      const auto at = [&row](int column) { return row[static_cast<std::size_t>(column)]; };
      TipReading r;
      r.q.resize(chain_.size());
      for (int j = 0; j < chain_.size(); ++j)
        r.q[j] = at(c.axes[static_cast<std::size_t>(j)]) *
                 (chain_.joints[static_cast<std::size_t>(j)].kind == JointKind::rotary
                      ? kRadiansPerDegree
                      : 1.0);
      r.tool_length = c.tool >= 0 ? at(c.tool) : length;
      if (c.sphere >= 0) {
        if (at(c.sphere) != std::floor(at(c.sphere)))
          return table_error("CSV106", "sphere: a whole number, the sphere's name, is expected",
                             numbers_.lines[i]);
        r.sphere = spheres.emplace(at(c.sphere), static_cast<int>(spheres.size())).first->second;
      }
      const auto& place = c.sphere >= 0 ? c.dial : c.tip;
      for (std::size_t k = 0; k < 3; ++k)
        if (place[k] >= 0) r.place[static_cast<int>(k)] = at(place[k]);
      readings_.push_back(std::move(r));
    }
    return true;
  }

  std::string name_of(const FitUnknown& u) const {
    std::string text = "tool.tip";
    if (u.parameter.joint >= 0)
      text = machine_.definition.axes[static_cast<std::size_t>(u.parameter.joint)].name +
             (u.parameter.kind == Kind::origin ? ".origin" : ".direction");
    for (int i = 0; i < 3; ++i)
      if (std::abs(u.along[i]) > 1.0 - 1e-9) return text + " along " + "XYZ"[i];
    text += " along [";
    for (int i = 0; i < 3; ++i) text += (i == 0 ? "" : " ") + decimal(u.along[i], 4);
    return text + "]";
  }

  void fit() {
    const ChainFit fit = fit_chain(chain_, readings_, parameters_);
    if (fit.status == ChainFit::Status::too_few) {
      table_error("KN180", std::to_string(readings_.size()) + " readings for " +
                               std::to_string(fit.unknowns.size()) +
                               " unknowns and the centres of the spheres: take more, at other "
                               "positions of the rotary axes");
      return;
    }
    if (fit.status == ChainFit::Status::not_observable) {
      std::string names;
      for (const int k : fit.hidden)
        names += (names.empty() ? "" : ", ") + name_of(fit.unknowns[static_cast<std::size_t>(k)]);
      table_error("KN181",
                  "these readings cannot tell: " + names +
                      ". Turn the axes further, use a second sphere or tool length, or fit "
                      "less by fit=");
      return;
    }
    if (fit.status == ChainFit::Status::not_converged) {
      table_error("KN182",
                  "no least squares solution was found from the machine file's numbers: check the "
                  "signs of the readings, and that they belong to this machine");
      return;
    }
    result_.text = report(fit);
    if (!options_.output.empty()) write(fit);
  }

  std::string report(const ChainFit& fit) const {
    const auto line = [&](const char* when, const std::vector<Vec3>& r) {
      const std::size_t at = worst(r);
      return std::string("  ") + when + ": rms " + decimal(rms(r), 5) + " mm, largest " +
             decimal(r[at].norm(), 5) + " mm (line " + std::to_string(numbers_.lines[at]) + ")\n";
    };
    std::string text = machine_.definition.name + ", " + std::to_string(readings_.size()) +
                       " readings, " + std::to_string(fit.spheres.size()) + " spheres\n";
    text += line("before", fit.before) + line("after", fit.after);
    text += "  condition " + decimal(fit.condition, 1) + "\n";
    for (const FitUnknown& u : fit.unknowns) {
      const bool angle = u.parameter.kind == Kind::direction;
      const double scale = angle ? kDegreesPerRadian : 1.0;
      text += "  " + name_of(u) + ": " + decimal(u.change * scale, 5) + " +- " +
              decimal(u.deviation * scale, 5) + (angle ? " deg\n" : " mm\n");
    }
    return text;
  }

  void write(const ChainFit& fit) {
    std::vector<VectorChange> changes;
    for (const FitParameter& p : parameters_) {
      if (p.kind == Kind::tip) {
        changes.push_back({"", "tip_mm", fit.chain.tool_home.translation(), 6});
        continue;
      }
      const auto j = static_cast<std::size_t>(p.joint);
      const std::string& axis = machine_.definition.axes[j].name;
      if (p.kind == Kind::origin)
        changes.push_back({axis, "origin_mm", fit.chain.joints[j].origin, 6});
      else
        changes.push_back({axis, "direction", fit.chain.joints[j].direction, 9});
    }
    const auto text = with_vectors(machine_.text, machine_.path, changes);
    add(text.diagnostics());
    if (!text.ok()) return;
    const auto valid = parse_machine_file(text.value(), options_.output);
    add(valid.diagnostics());
    if (!valid.ok()) return;
    result_.program = text.value();
    if (options_.output == "-") {
      result_.text.clear();
      return;
    }
    std::error_code error;
    for (const std::string& input : {machine_.path, table_})
      if (fs::equivalent(options_.output, input, error)) {
        usage("US105", "-o " + options_.output + " is an input file: name another output");
        return;
      }
    result_.program_path = options_.output;
    const Diagnostics faults = write_file(options_.output, result_.program);
    add(faults);
    if (!has_error(faults)) result_.summary = "fitted machine " + machine_.definition.name;
  }

  const Options& options_;
  JobResult result_;
  std::string table_, wanted_;
  LoadedMachine machine_;
  ScrewChain chain_;
  NumberTable numbers_;
  std::vector<FitParameter> parameters_;
  std::vector<TipReading> readings_;
  bool unreadable_ = false;
};

}  // namespace

JobResult run_fit_command(const Options& options) { return Fit(options).run(); }

}  // namespace smoothpost
