#include <algorithm>
#include <cmath>
#include <set>

#include "formats/urdf/urdf.h"
#include "kernels/core/units.h"
#include "machines/import/imported_machine.h"

namespace smoothpost {

namespace {

constexpr double kMillimetresPerMetre = 1000.0;
constexpr double kUnlimited = 36000.0 * kRadiansPerDegree;  // range of a continuous joint

bool moves(const urdf::Joint& joint) { return joint.type != "fixed"; }

class Importer {
 public:
  Importer(const urdf::Robot& robot, const std::vector<urdf::NamedYamlLimits>& limits,
           const UrdfTexts& texts, const ImportWords& said)
      : robot_(robot), limits_(limits), texts_(texts), said_(said) {}

  Result<ImportedMachine> run() {
    ImportedMachine m;
    const std::string base = said("base", robot_.root);
    const std::string tip = choose_tip(base);
    const auto chain = chain_to(tip, base);
    if (has_error(diagnostics_)) return failure();
    m.name = robot_.name;
    m.description = "imported from URDF: " + base + " to " + tip;
    walk(chain, tip, m);
    check_yaml_names();
    list_bodies(chain, base, m);
    const Diagnostics faults = check_imported(m, texts_.urdf_name);
    diagnostics_.insert(diagnostics_.end(), faults.begin(), faults.end());
    if (has_error(diagnostics_)) return failure();
    return {std::move(m), std::move(diagnostics_)};
  }

 private:
  Result<ImportedMachine> failure() {
    return Result<ImportedMachine>::failure(std::move(diagnostics_));
  }
  void add(Severity severity, const char* code, std::string text, int line = 0) {
    if (diagnostics_.size() < 50)
      diagnostics_.push_back({severity, code, std::move(text), {texts_.urdf_name, line, 0}});
  }
  std::string said(const char* key, const std::string& otherwise) const {
    const auto found = said_.find(key);
    return found == said_.end() ? otherwise : found->second;
  }

  const urdf::Joint* joint_above(const std::string& link) const {
    for (const urdf::Joint& j : robot_.joints)
      if (j.child == link) return &j;
    return nullptr;
  }
  bool has_link(const std::string& name) const {
    return std::any_of(robot_.links.begin(), robot_.links.end(),
                       [&](const urdf::Link& l) { return l.name == name; });
  }

  /// Joints from `base` to `tip`; an error when one is not below the other.
  std::vector<const urdf::Joint*> chain_to(const std::string& tip, const std::string& base) {
    std::vector<const urdf::Joint*> chain;
    std::string at = tip;
    while (at != base) {
      const urdf::Joint* joint = joint_above(at);
      if (joint == nullptr) {
        add(Severity::error, "MF205",
            "link " + tip + " does not hang on link " + base + ": say other base= and tip=");
        return {};
      }
      chain.push_back(joint);
      at = joint->parent;
    }
    std::reverse(chain.begin(), chain.end());
    return chain;
  }

  /// Number of moving joints above a link.
  int depth(const std::string& link) const {
    int count = 0;
    std::string at = link;
    while (const urdf::Joint* joint = joint_above(at)) {
      count += moves(*joint) ? 1 : 0;
      at = joint->parent;
    }
    return count;
  }

  std::string choose_tip(const std::string& base) {
    for (const char* key : {"base", "tip"})
      if (const auto found = said_.find(key); found != said_.end() && !has_link(found->second)) {
        add(Severity::error, "MF205",
            std::string(key) + "=" + found->second + ": there is no such link");
        return base;
      }
    if (const auto found = said_.find("tip"); found != said_.end()) return found->second;
    if (has_link("tool0")) return "tool0";
    std::set<std::string> parents;
    for (const urdf::Joint& j : robot_.joints) parents.insert(j.parent);
    std::vector<std::string> ends;
    int most = 0;
    for (const urdf::Link& l : robot_.links) {
      if (parents.count(l.name) != 0) continue;
      const int joints = depth(l.name);
      if (joints > most) ends.clear();
      most = std::max(most, joints);
      if (joints == most) ends.push_back(l.name);
    }
    if (ends.size() == 1) return ends.front();
    std::string names;
    for (std::size_t i = 0; i < std::min<std::size_t>(ends.size(), 8); ++i)
      names += (i == 0 ? "" : ", ") + ends[i];
    add(Severity::error, "MF205",
        "several links end the chain with most joints and none is called tool0: say one of " +
            names + " as tip=LINK");
    return base;
  }

  static Pose pose_of(const urdf::Joint& j) {
    Pose pose = Pose::Identity();
    pose.translation() = kMillimetresPerMetre * Vec3(j.xyz[0], j.xyz[1], j.xyz[2]);
    pose.linear() = rotation_from_rpy(j.rpy[0], j.rpy[1], j.rpy[2]);
    return pose;
  }

  void walk(const std::vector<const urdf::Joint*>& chain, const std::string& tip,
            ImportedMachine& m) {
    Pose at = Pose::Identity();  // of the link, in M, every joint at 0
    for (const urdf::Joint* joint : chain) {
      at = at * pose_of(*joint);
      if (moves(*joint)) add_axis(*joint, at, m);
    }
    const bool arm = m.axes.size() == 6 &&
                     std::all_of(m.axes.begin(), m.axes.end(),
                                 [](const ImportedAxis& a) { return a.kind == JointKind::rotary; });
    m.kind = arm ? "robot" : "five_axis";
    m.dialect = "ros_trajectory";
    m.tip = at.translation();
    m.tool_axis = -at.linear().col(2);
    m.tool_note = tip == "tool0"
                      ? "a tool of length 0 ends at tool0 and points along its Z, as ROS has it"
                      : "a tool of length 0 ends at link " + tip + " and points along its Z";
    m.flange = at;
  }

  void add_axis(const urdf::Joint& j, const Pose& at, ImportedMachine& m) {
    if (j.type == "floating" || j.type == "planar")
      return add(Severity::error, "MF202",
                 "joint " + j.name + " is " + j.type + ": axes of machines turn or slide; choose " +
                     "another chain by base= and tip=",
                 j.line);
    if (!j.mimics.empty())
      return add(Severity::error, "MF202",
                 "joint " + j.name + " follows joint " + j.mimics +
                     " (mimic): coupled joints are not read; choose another chain by tip=",
                 j.line);
    ImportedAxis axis;
    axis.name = axis_name(j.name);
    axis.letter = static_cast<char>('A' + std::min<std::size_t>(m.axes.size(), 25));
    axis.comment = "joint " + j.name;
    axis.kind = j.type == "prismatic" ? JointKind::linear : JointKind::rotary;
    axis.direction = at.linear() * Vec3(j.axis[0], j.axis[1], j.axis[2]);
    axis.origin = at.translation();
    limits(j, axis);
    m.axes.push_back(std::move(axis));
  }

  static std::string axis_name(const std::string& joint) {
    std::string out;
    for (const char c : joint.substr(0, 60)) {
      const bool letter = (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z');
      const bool other = (c >= '0' && c <= '9') || c == '_';
      if (out.empty() && !letter) out = "J";
      out += letter || other ? c : '_';
    }
    return out.empty() || out == "base" || out == "workpiece" ? "J_" + out : out;
  }

  void limits(const urdf::Joint& j, ImportedAxis& axis) {
    const double scale = axis.kind == JointKind::linear ? kMillimetresPerMetre : 1.0;
    const auto yaml = std::find_if(limits_.begin(), limits_.end(),
                                   [&](const auto& l) { return l.joint == j.name; });
    urdf::YamlLimits more;
    if (yaml != limits_.end()) {
      more = yaml->limits;
      used_.insert(j.name);
    }
    auto lower = j.limits.lower, upper = j.limits.upper;
    if (more.lower) lower = lower ? std::max(*lower, *more.lower) : *more.lower;
    if (more.upper) upper = upper ? std::min(*upper, *more.upper) : *more.upper;
    if (j.type == "continuous") {
      axis.cyclic = true;
      axis.lower = {-kUnlimited, "the joint turns without end"};
      axis.upper = {kUnlimited, "the joint turns without end"};
      if (more.lower && more.upper) {
        axis.lower = {*more.lower, {}};
        axis.upper = {*more.upper, {}};
      }
    } else if (!lower && !upper) {
      return add(Severity::error, "MF203",
                 "joint " + j.name + " has no range: <limit lower= upper=>", j.line);
    } else {
      // A bound that <limit> leaves out is 0 by the format's own rule.
      axis.lower.value = lower.value_or(0.0) * scale;
      axis.upper.value = upper.value_or(0.0) * scale;
    }
    const auto scaled = [scale](const std::optional<double>& v) -> std::optional<double> {
      if (!v || !(*v > 0.0)) return std::nullopt;
      return *v * scale;
    };
    axis.velocity = scaled(j.limits.velocity);
    if (const auto v = scaled(more.velocity))
      axis.velocity = axis.velocity ? std::min(*axis.velocity, *v) : *v;
    axis.acceleration = scaled(more.acceleration);
    axis.jerk = scaled(more.jerk);
  }

  void check_yaml_names() {
    for (const auto& l : limits_)
      if (used_.count(l.joint) == 0)
        diagnostics_.push_back(
            {Severity::warning,
             "MF207",
             "joint " + l.joint + " is not one of the chain's: its limits are not used",
             {texts_.limits_name, l.limits.line, 0}});
  }

  void list_bodies(const std::vector<const urdf::Joint*>& chain, const std::string& base,
                   ImportedMachine& m) const {
    std::string carrier = "base";
    const auto add_link = [&](const std::string& name) {
      for (const urdf::Link& l : robot_.links)
        if (l.name == name)
          for (const std::string& shape : l.collision)
            m.left_out.push_back("the URDF has for " + carrier + " (link " + name + "): " + shape);
    };
    add_link(base);
    std::size_t axis = 0;
    for (const urdf::Joint* joint : chain) {
      if (moves(*joint) && axis < m.axes.size()) carrier = m.axes[axis++].name;
      add_link(joint->child);
    }
  }

  const urdf::Robot& robot_;
  const std::vector<urdf::NamedYamlLimits>& limits_;
  const UrdfTexts& texts_;
  const ImportWords& said_;
  std::set<std::string> used_;
  Diagnostics diagnostics_;
};

}  // namespace

Result<ImportedMachine> import_urdf(const UrdfTexts& texts, const ImportWords& said) {
  const auto robot = urdf::read_urdf(texts.urdf, texts.urdf_name);
  Diagnostics faults = robot.diagnostics();
  std::vector<urdf::NamedYamlLimits> limits;
  if (texts.limits) {
    const auto read = urdf::read_joint_limits(*texts.limits, texts.limits_name);
    faults.insert(faults.end(), read.diagnostics().begin(), read.diagnostics().end());
    if (read.ok()) limits = read.value();
  }
  if (has_error(faults)) return Result<ImportedMachine>::failure(std::move(faults));
  return Importer(robot.value(), limits, texts, said).run();
}

}  // namespace smoothpost
