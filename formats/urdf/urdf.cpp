#include "formats/urdf/urdf.h"

#include <tinyxml2.h>

#include <cmath>
#include <map>
#include <set>

#include "kernels/core/signed_number.h"

namespace smoothpost::urdf {

namespace {

using tinyxml2::XMLElement;

constexpr double kLargest = 1e6;  // m or rad

class Reader {
 public:
  explicit Reader(const std::string& file) : file_(file) {}

  Result<Robot> read(std::string_view text) {
    Robot robot;
    tinyxml2::XMLDocument document;
    if (text.size() > kMaxBytes) {
      error("MF201", "the file is larger than 16 MiB: is it the robot's description?", 0);
    } else if (document.Parse(text.data(), text.size()) != tinyxml2::XML_SUCCESS) {
      error("MF201", "not XML: " + std::string(document.ErrorName()), document.ErrorLineNum());
    } else if (const XMLElement* root = document.RootElement();
               root == nullptr || std::string_view(root->Name()) != "robot") {
      error("MF201", "not a URDF: its first element is not <robot>", 1);
    } else {
      read_robot(*root, robot);
      if (!has_error(diagnostics_)) check_tree(robot);
    }
    if (has_error(diagnostics_)) return Result<Robot>::failure(std::move(diagnostics_));
    return {std::move(robot), std::move(diagnostics_)};
  }

 private:
  void error(const char* code, std::string text, int line) {
    constexpr std::size_t kMost = 50;
    if (diagnostics_.size() < kMost)
      diagnostics_.push_back({Severity::error, code, std::move(text), {file_, line, 0}});
  }

  static std::string attribute(const XMLElement* element, const char* name) {
    const char* text = element == nullptr ? nullptr : element->Attribute(name);
    return text == nullptr ? "" : std::string(text).substr(0, 256);
  }

  void read_robot(const XMLElement& root, Robot& robot) {
    robot.name = attribute(&root, "name");
    for (const XMLElement* e = root.FirstChildElement(); e != nullptr;
         e = e->NextSiblingElement()) {
      const std::string_view name = e->Name();
      if (name.substr(0, 6) == "xacro:") {
        error("MF202",
              "<" + std::string(name.substr(0, 64)) +
                  "> is xacro that is not expanded: run `xacro FILE > robot.urdf` and import that",
              e->GetLineNum());
        return;
      }
      if (robot.links.size() > kMaxElements || robot.joints.size() > kMaxElements) {
        error("MF204", "more than 2000 links or joints", e->GetLineNum());
        return;
      }
      if (name == "link") robot.links.push_back(read_link(*e));
      if (name == "joint") robot.joints.push_back(read_joint(*e));
    }
  }

  static Link read_link(const XMLElement& e) {
    constexpr std::size_t kMostShapes = 100;
    Link link;
    link.name = attribute(&e, "name");
    link.line = e.GetLineNum();
    for (const XMLElement* c = e.FirstChildElement("collision");
         c != nullptr && link.collision.size() < kMostShapes;
         c = c->NextSiblingElement("collision")) {
      const XMLElement* geometry = c->FirstChildElement("geometry");
      const XMLElement* shape = geometry == nullptr ? nullptr : geometry->FirstChildElement();
      if (shape == nullptr) continue;
      std::string words = std::string(shape->Name()).substr(0, 64);
      if (words == "mesh") words += " " + attribute(shape, "filename");
      link.collision.push_back(std::move(words));
    }
    return link;
  }

  Joint read_joint(const XMLElement& e) {
    Joint joint;
    joint.name = attribute(&e, "name");
    joint.type = attribute(&e, "type");
    joint.line = e.GetLineNum();
    joint.parent = attribute(e.FirstChildElement("parent"), "link");
    joint.child = attribute(e.FirstChildElement("child"), "link");
    static const std::set<std::string, std::less<>> kTypes = {"revolute", "continuous", "prismatic",
                                                              "fixed",    "floating",   "planar"};
    if (kTypes.count(joint.type) == 0)
      error("MF202", "joint " + joint.name + ": type \"" + joint.type + "\" does not exist",
            joint.line);
    if (const XMLElement* origin = e.FirstChildElement("origin")) {
      vector(*origin, "xyz", joint.name, joint.xyz);
      vector(*origin, "rpy", joint.name, joint.rpy);
    }
    if (const XMLElement* axis = e.FirstChildElement("axis")) {
      vector(*axis, "xyz", joint.name, joint.axis);
      if (joint.type != "fixed" && std::hypot(joint.axis[0], joint.axis[1], joint.axis[2]) < 1e-9)
        error("MF203", "joint " + joint.name + ": its axis has no length", axis->GetLineNum());
    }
    if (const XMLElement* mimic = e.FirstChildElement("mimic"))
      joint.mimics = attribute(mimic, "joint");
    if (const XMLElement* limit = e.FirstChildElement("limit")) {
      joint.limits.lower = number(*limit, "lower", joint.name);
      joint.limits.upper = number(*limit, "upper", joint.name);
      joint.limits.velocity = number(*limit, "velocity", joint.name);
    }
    return joint;
  }

  void wrong_number(const XMLElement& e, const char* name, const std::string& joint,
                    std::string_view text) {
    error("MF203",
          "joint " + joint + ": " + name + "=\"" + std::string(text.substr(0, 64)) + "\" in <" +
              e.Name() + "> is not made of numbers up to 1000000" +
              (text.find("${") == std::string_view::npos ? "" : " (xacro that is not expanded)"),
          e.GetLineNum());
  }

  /// One number from the front of `text`.
  static std::optional<double> take(std::string_view& text) {
    while (!text.empty() && std::string_view(" \t\r\n").find(text.front()) != text.npos)
      text.remove_prefix(1);
    double value = 0.0;
    const auto [end, fault] = from_signed(text, value);
    if (fault != std::errc() || !(std::abs(value) <= kLargest)) return std::nullopt;
    text.remove_prefix(static_cast<std::size_t>(end - text.data()));
    return value + 0.0;
  }

  static bool blank(std::string_view text) {
    return text.find_first_not_of(" \t\r\n") == std::string_view::npos;
  }

  std::optional<double> number(const XMLElement& e, const char* name, const std::string& joint) {
    const char* given = e.Attribute(name);
    if (given == nullptr) return std::nullopt;
    std::string_view text = given;
    const auto value = take(text);
    if (!value || !blank(text)) {
      wrong_number(e, name, joint, given);
      return std::nullopt;
    }
    return value;
  }

  void vector(const XMLElement& e, const char* name, const std::string& joint,
              std::array<double, 3>& into) {
    const char* given = e.Attribute(name);
    if (given == nullptr) return;
    std::string_view text = given;
    for (double& component : into) {
      const auto value = take(text);
      if (!value) return wrong_number(e, name, joint, given);
      component = *value;
    }
    if (!blank(text)) wrong_number(e, name, joint, given);
  }

  void check_tree(Robot& robot) {
    std::map<std::string, const Joint*> parent_of;
    std::set<std::string> names, joints;
    for (const Link& link : robot.links)
      if (!names.insert(link.name).second)
        error("MF204", "two links are called \"" + link.name + "\"", link.line);
    for (const Joint& joint : robot.joints) {
      if (!joints.insert(joint.name).second)
        error("MF204", "two joints are called \"" + joint.name + "\"", joint.line);
      for (const std::string& link : {joint.parent, joint.child})
        if (names.count(link) == 0)
          error("MF204",
                "joint " + joint.name + " names the link \"" + link + "\", which is not there",
                joint.line);
      if (!parent_of.emplace(joint.child, &joint).second)
        error("MF204",
              "link " + joint.child + " has two parents: joint " + joint.name + " and joint " +
                  parent_of[joint.child]->name,
              joint.line);
    }
    for (const Link& link : robot.links) {
      if (parent_of.count(link.name) != 0) continue;
      if (!robot.root.empty())
        error("MF204",
              "links " + robot.root + " and " + link.name + " are both a root: one tree is read",
              link.line);
      robot.root = link.name;
    }
    if (robot.root.empty())
      error("MF204", robot.links.empty() ? "the robot has no link" : "the links form a ring", 1);
    if (!has_error(diagnostics_)) check_reached(robot, parent_of);
  }

  /// With one root and one parent each, what is not reached from the root is a ring.
  void check_reached(const Robot& robot, const std::map<std::string, const Joint*>& parent_of) {
    std::set<std::string> reached = {robot.root};
    for (const Link& link : robot.links) {
      std::vector<std::string> way;
      std::string at = link.name;
      while (reached.count(at) == 0 && way.size() <= robot.links.size()) {
        way.push_back(at);
        at = parent_of.at(at)->parent;
      }
      if (way.size() > robot.links.size())
        return error("MF204", "link " + link.name + " hangs in a ring of joints", link.line);
      reached.insert(way.begin(), way.end());
    }
  }

  std::string file_;
  Diagnostics diagnostics_;
};

}  // namespace

Result<Robot> read_urdf(std::string_view text, const std::string& file) {
  return Reader(file).read(text);
}

}  // namespace smoothpost::urdf
