#include <catch2/catch.hpp>
#include <map>
#include <random>
#include <regex>
#include <sstream>

#include "kernels/core/units.h"
#include "machines/definition/machine_file.h"
#include "machines/import/imported_machine.h"
#include "tests/support/support.h"

using namespace smoothpost;
using Matrix4 = Eigen::Matrix4d;

namespace {

/// The machine file of an import, read as users' files are.
MachineDefinition machine_of(const Result<ImportedMachine>& made) {
  for (const auto& d : made.diagnostics()) UNSCOPED_INFO(to_string(d));
  REQUIRE(made.ok());
  const std::string text = machine_text(made.value());
  UNSCOPED_INFO(text);
  const auto read = parse_machine_file(text, "machine.toml");
  for (const auto& d : read.diagnostics()) UNSCOPED_INFO(to_string(d));
  REQUIRE(read.ok());
  return read.value();
}

Result<ImportedMachine> from_urdf(const std::string& text, const ImportWords& said = {},
                                  const std::string& limits = {}) {
  UrdfTexts texts{text, "r.urdf", std::nullopt, "limits.yaml"};
  if (!limits.empty()) texts.limits = limits;
  return import_urdf(texts, said);
}

bool says(const Result<ImportedMachine>& made, const std::string& code, const std::string& words) {
  for (const auto& d : made.diagnostics()) {
    UNSCOPED_INFO(to_string(d));
    if (d.code == code && d.text.find(words) != std::string::npos) return true;
  }
  return false;
}

/// One <joint> of a URDF by regular expressions, without any reader of ours.
struct PlainJoint {
  std::string type, parent, child;
  Matrix4 origin = Matrix4::Identity();
  Eigen::Vector3d axis = Eigen::Vector3d::UnitX();
  double lower = 0.0, upper = 0.0;
};

Matrix4 turn(char axis, double angle) {
  const double c = std::cos(angle), s = std::sin(angle);
  Matrix4 m = Matrix4::Identity();
  const int i = axis == 'x' ? 1 : axis == 'y' ? 2 : 0, k = axis == 'x' ? 2 : axis == 'y' ? 0 : 1;
  m(i, i) = c;
  m(i, k) = -s;
  m(k, i) = s;
  m(k, k) = c;
  return m;
}

Eigen::Vector3d three(const std::string& text) {
  std::istringstream in(text);
  Eigen::Vector3d v;
  in >> v[0] >> v[1] >> v[2];
  return v;
}

std::vector<PlainJoint> plain_joints(const std::string& text) {
  const auto attribute = [](const std::string& block, const std::string& element,
                            const std::string& name) {
    std::smatch m;
    const std::regex e("<" + element + "\\b[^>]*\\b" + name + "=\"([^\"]*)\"");
    return std::regex_search(block, m, e) ? m[1].str() : std::string();
  };
  std::vector<PlainJoint> out;
  const std::regex joint("<joint[\\s\\S]*?</joint>");
  for (std::sregex_iterator it(text.begin(), text.end(), joint), end; it != end; ++it) {
    const std::string block = it->str();
    PlainJoint j;
    j.type = attribute(block, "joint", "type");
    j.parent = attribute(block, "parent", "link");
    j.child = attribute(block, "child", "link");
    const std::string xyz = attribute(block, "origin", "xyz"),
                      rpy = attribute(block, "origin", "rpy");
    if (!rpy.empty()) {
      const auto r = three(rpy);
      j.origin = turn('z', r[2]) * turn('y', r[1]) * turn('x', r[0]);
    }
    if (!xyz.empty()) j.origin.topRightCorner<3, 1>() = 1000.0 * three(xyz);
    const std::string axis = attribute(block, "axis", "xyz");
    if (!axis.empty()) j.axis = three(axis).normalized();
    const std::string lower = attribute(block, "limit", "lower");
    if (!lower.empty()) {
      j.lower = std::stod(lower);
      j.upper = std::stod(attribute(block, "limit", "upper"));
    }
    out.push_back(j);
  }
  return out;
}

/// The tip's frame by multiplying the frames joint by joint; Rodrigues' formula for each turn.
Matrix4 plain_forward(const std::vector<PlainJoint>& joints, const std::string& root,
                      const std::string& tip, const std::vector<double>& q) {
  std::vector<const PlainJoint*> chain;
  for (std::string at = tip; at != root;) {
    for (const PlainJoint& j : joints)
      if (j.child == at) {
        chain.insert(chain.begin(), &j);
        at = j.parent;
        break;
      }
  }
  Matrix4 pose = Matrix4::Identity();
  std::size_t next = 0;
  for (const PlainJoint* j : chain) {
    pose = pose * j->origin;
    if (j->type == "fixed") continue;
    const double value = q[next++];
    Matrix4 move = Matrix4::Identity();
    if (j->type == "prismatic") {
      move.topRightCorner<3, 1>() = value * j->axis;
    } else {
      Eigen::Matrix3d k;
      k << 0, -j->axis.z(), j->axis.y(), j->axis.z(), 0, -j->axis.x(), -j->axis.y(), j->axis.x(), 0;
      move.topLeftCorner<3, 3>() += std::sin(value) * k + (1.0 - std::cos(value)) * k * k;
    }
    pose = pose * move;
  }
  return pose;
}

/// Random joint values through both ways; the largest difference of tip (mm) and tool axis.
double forward_difference(const std::string& urdf, const std::string& root,
                          const std::string& tip) {
  const MachineDefinition machine = machine_of(from_urdf(urdf));
  const ScrewChain chain = chain_of(machine);
  const auto joints = plain_joints(urdf);
  std::mt19937 random(7);
  double largest = 0.0;
  for (int i = 0; i < 200; ++i) {
    JointVector q(chain.size());
    std::vector<double> values;
    for (int j = 0; j < chain.size(); ++j) {
      const auto& joint = chain.joints[static_cast<std::size_t>(j)];
      q[j] = std::uniform_real_distribution<double>(joint.lower, joint.upper)(random);
      values.push_back(q[j]);
    }
    const Matrix4 expected = plain_forward(joints, root, tip, values);
    const CutterLocation at = forward_location(chain, q);
    largest = std::max(largest, (at.tip - expected.topRightCorner<3, 1>()).norm());
    largest = std::max(largest, 1000.0 * (at.axis + expected.block<3, 1>(0, 2)).norm());
  }
  return largest;
}

const std::string kCrooked = R"(<robot name="crooked arm">
  <link name="base_link"/><link name="l1"><collision><geometry><mesh filename="a.stl"/></geometry></collision></link>
  <link name="l2"/><link name="l3"/><link name="tool0"/>
  <joint name="j 1" type="revolute"><origin xyz="0.1 0.2 0.3" rpy="0.3 -0.2 1.1"/>
    <parent link="base_link"/><child link="l1"/><axis xyz="1 2 -3"/><limit lower="-2" upper="3" velocity="1.5"/></joint>
  <joint name="j2" type="prismatic"><origin xyz="0 0 0.4" rpy="0 1 0"/>
    <parent link="l1"/><child link="l2"/><axis xyz="0 1 1"/><limit lower="0.1" upper="0.5" velocity="0.2"/></joint>
  <joint name="j3" type="continuous"><origin xyz="-0.2 0 0"/>
    <parent link="l2"/><child link="l3"/><axis xyz="0 0 1"/></joint>
  <joint name="mount" type="fixed"><origin xyz="0 0 0.1" rpy="1.2 0 0.4"/><parent link="l3"/><child link="tool0"/></joint>
</robot>)";

std::string ini_text(const std::string& kinematics, const std::string& letters,
                     const std::string& more = {}) {
  std::string text = "[EMC]\nMACHINE = test mill\n[KINS]\nKINEMATICS = " + kinematics +
                     "\nJOINTS = " + std::to_string(letters.size()) +
                     "\n[TRAJ]\nLINEAR_UNITS = mm\nANGULAR_UNITS = degree\n" + more;
  for (std::size_t j = 0; j < letters.size(); ++j)
    text += "[JOINT_" + std::to_string(j) + "]\nTYPE = " +
            (std::string("ABC").find(letters[j]) == std::string::npos ? "LINEAR" : "ANGULAR") +
            "\nMIN_LIMIT = -120\nMAX_LIMIT = 150\nMAX_VELOCITY = 20\nMAX_ACCELERATION = 300\n";
  return text;
}

Result<ImportedMachine> from_ini(const std::string& text, const ImportWords& said = {}) {
  return import_linuxcnc(text, "mill.ini", {}, said);
}

}  // namespace

TEST_CASE("import_urdf: forward kinematics as multiplied frame by frame", "[machines][import]") {
  CHECK(forward_difference(kCrooked, "base_link", "tool0") < 1e-4);  // 1e-9 deg on 36000 deg
}

TEST_CASE("import_urdf: what is not said is assumed and marked", "[machines][import]") {
  const auto made = from_urdf(kCrooked);
  const MachineDefinition m = machine_of(made);
  CHECK(m.name == "crooked_arm");
  REQUIRE(m.size() == 3);
  CHECK(m.axes[0].name == "j_1");
  CHECK(m.axes[0].source == LimitSource::assumed);
  CHECK(m.axes[0].velocity == Approx(1.5).epsilon(1e-8));
  CHECK(m.axes[0].acceleration == Approx(6.0).epsilon(1e-8));
  CHECK(m.axes[0].jerk == Approx(60.0).epsilon(1e-8));
  CHECK(m.axes[1].joint.lower == Approx(100.0));
  CHECK(m.axes[1].joint.home == Approx(300.0));  // 0 is outside
  CHECK(m.axes[2].joint.cyclic);
  const std::string text = machine_text(made.value());
  CHECK(text.find("max_jerk_deg_per_s3 = 3437.746770785  # assumed") != std::string::npos);
  CHECK(text.find("link l1): mesh a.stl") != std::string::npos);
  CHECK(assumptions(made.value()).find("j_1, j2, j3") != std::string::npos);
}

TEST_CASE("import_urdf: joint limits of a YAML file tighten and complete", "[machines][import]") {
  const std::string limits =
      "joint_limits:\n  j2: {max_velocity: 0.1, max_acceleration: 1, max_jerk: 20, "
      "min_position: 0.2, max_position: 9}\n  gone: {max_velocity: 1}\n";
  const auto made = from_urdf(kCrooked, {}, limits);
  const MachineDefinition m = machine_of(made);
  CHECK(m.axes[1].velocity == Approx(100.0));
  CHECK(m.axes[1].acceleration == Approx(1000.0));
  CHECK(m.axes[1].jerk == Approx(20000.0));
  CHECK(m.axes[1].source == LimitSource::datasheet);
  CHECK(m.axes[1].joint.lower == Approx(200.0));
  CHECK(m.axes[1].joint.upper == Approx(500.0));
  CHECK(says(made, "MF207", "gone"));
}

TEST_CASE("import_urdf: chains that are not told or coupled are refused", "[machines][import]") {
  const auto with = [](const std::string& old, const std::string& now) {
    std::string text = kCrooked;
    REQUIRE(text.find(old) != std::string::npos);
    return text.replace(text.find(old), old.size(), now);
  };
  CHECK(says(from_urdf(with("type=\"prismatic\"", "type=\"floating\"")), "MF202", "floating"));
  CHECK(
      says(from_urdf(with("<axis xyz=\"0 1 1\"/>", "<mimic joint=\"j3\"/>")), "MF202", "follows"));
  CHECK(says(from_urdf(with("<limit lower=\"-2\" upper=\"3\" velocity=\"1.5\"/>", "")), "MF203",
             "no range"));
  CHECK(says(from_urdf(with("lower=\"-2\" upper=\"3\"", "lower=\"3\" upper=\"-2\"")), "MF203",
             "reversed"));
  CHECK(says(from_urdf(kCrooked, {{"tip", "l9"}}), "MF205", "l9"));
  CHECK(says(from_urdf(kCrooked, {{"tip", "l1"}, {"base", "l2"}}), "MF205", "does not hang"));
  CHECK(machine_of(from_urdf(kCrooked, {{"tip", "l2"}})).size() == 2);
  std::string two = kCrooked;
  for (std::size_t at; (at = two.find("tool0")) != std::string::npos;) two.replace(at, 5, "hand");
  two.insert(two.find("<joint"),
             "<link name=\"lamp\"/><joint name=\"l\" type=\"fixed\">"
             "<parent link=\"l3\"/><child link=\"lamp\"/></joint>");
  CHECK(says(from_urdf(two), "MF205", "hand, lamp"));
  CHECK(machine_of(from_urdf(two, {{"tip", "hand"}})).size() == 3);
}

TEST_CASE("import_urdf: every description of the corpus is imported or refused by name",
          "[machines][import]") {
  const auto files = test::corpus_files("6_robot_model", {".urdf", ".xacro"});
  if (files.empty()) {
    WARN("no corpus: skipped");
    return;
  }
  std::map<std::string, int> table;
  for (const auto& file : files) {
    INFO(file);
    const std::string text = test::read_bytes(file);
    const auto made = from_urdf(text);
    REQUIRE(made.ok() != has_error(made.diagnostics()));
    if (!made.ok()) {
      ++table["refused, " + made.diagnostics().front().code];
      CHECK(made.diagnostics().front().text.find("xacro") != std::string::npos);
      CHECK(made.diagnostics().front().where.line > 0);
      continue;
    }
    ++table["imported"];
    CHECK(machine_of(made).size() == 6);
    CHECK(forward_difference(text, "base_link", "tool0") < 2e-5);
  }
  for (const auto& [what, count] : table) WARN("6_robot_model: " << what << ": " << count);
  CHECK(table["imported"] == 2);
}

TEST_CASE("import_linuxcnc: a trunnion stands where its kinematics module puts it",
          "[machines][import]") {
  // trtfuncs.c: joints of a point of the part, offsets and rotary centre included.
  const Vec3 r(3.0, -4.0, 5.0);
  for (const char tilt : {'A', 'B'}) {
    const std::string module = std::string("xyz") + (tilt == 'A' ? "ac" : "bc") + "-trt-kins";
    const Vec3 d = tilt == 'A' ? Vec3(0.0, 20.0, 10.0) : Vec3(20.0, 0.0, 10.0);
    const MachineDefinition m = machine_of(from_ini(
        ini_text(module + " sparm=identityfirst", std::string("XYZ") + tilt + "C",
                 "[HAL]\nHALCMD = net :o " + module + (tilt == 'A' ? ".y-offset" : ".x-offset") +
                     "\nHALCMD = sets :o 20\nHALCMD = setp " + module +
                     ".z-offset 10\nHALCMD = setp " + module + ".x-rot-point 3\nHALCMD = setp " +
                     module + ".y-rot-point -4\nHALCMD = setp " + module + ".z-rot-point 5\n")));
    REQUIRE(m.size() == 5);
    const ScrewChain chain = chain_of(m);
    std::mt19937 random(3);
    std::uniform_real_distribution<double> value(-1.0, 1.0);
    for (int i = 0; i < 50; ++i) {
      const Vec3 point = 50.0 * Vec3(value(random), value(random), value(random));
      const double t = value(random), c = 3.0 * value(random);
      const Mat3 rt =
          Eigen::AngleAxisd(t, tilt == 'A' ? Vec3::UnitX() : Vec3::UnitY()).toRotationMatrix();
      const Mat3 rc = Eigen::AngleAxisd(c, Vec3::UnitZ()).toRotationMatrix();
      const Vec3 joints = rt * (rc * (point - r) - d) + d + r;
      JointVector q(5);
      q << joints, t, c;
      CHECK((forward_location(chain, q).tip - point).norm() < 1e-8);
    }
  }
}

TEST_CASE("import_linuxcnc: the bridge mill's head hangs by its pivot length",
          "[machines][import]") {
  const auto made = from_ini(
      ini_text("5axiskins", "XYZBCW", "[HAL]\nHALCMD = setp 5axiskins.pivot-length 180\n"));
  const MachineDefinition m = machine_of(made);
  REQUIRE(m.size() == 6);
  const ScrewChain chain = chain_of(m);  // X Y Z C B W
  std::mt19937 random(5);
  std::uniform_real_distribution<double> value(-1.0, 1.0);
  for (int i = 0; i < 50; ++i) {
    const double b = value(random), c = value(random), w = 20.0 * value(random);
    const Vec3 xyz = 100.0 * Vec3(value(random), value(random), value(random));
    const double reach = 180.0 + w;  // 5axiskins.c: a sphere about the joints' point
    const Vec3 tip =
        xyz + reach * Vec3(std::sin(b) * std::cos(c), std::sin(b) * std::sin(c), -std::cos(b)) +
        Vec3(0.0, 0.0, 180.0);
    JointVector q(6);
    q << xyz, c, b, w;
    CHECK((forward_location(chain, q).tip - tip).norm() < 1e-8);
  }
  const auto by_signal = from_ini(
      ini_text("5axiskins", "XYZBCW", "[HAL]\nHALCMD = net len => 5axiskins.pivot-length\n"));
  CHECK(assumptions(by_signal.value()).find("place of B") != std::string::npos);
}

TEST_CASE("import_linuxcnc: genserkins by modified Denavit-Hartenberg", "[machines][import]") {
  const double a[] = {0, 85, 380, 100, 0, 0}, d[] = {350, 0, 0, 425, 0, 235};
  const double alpha[] = {0, -kPi / 2, 0, -kPi / 2, kPi / 2, -kPi / 2};
  std::string hal = "[HAL]\n";
  for (int j = 0; j < 6; ++j)
    for (const auto& [name, value] : {std::pair{"A", a[j]}, {"D", d[j]}, {"ALPHA", alpha[j]}}) {
      std::ostringstream line;
      line.precision(15);
      line << "HALCMD = setp genserkins." << name << "-" << j << " " << value << "\n";
      hal += line.str();
    }
  const MachineDefinition m = machine_of(from_ini(ini_text("genserkins", "ABCABC", hal)));
  const ScrewChain chain = chain_of(m);
  std::mt19937 random(9);
  std::uniform_real_distribution<double> angle(-2.0, 2.0);
  for (int i = 0; i < 50; ++i) {
    JointVector q(6);
    Matrix4 pose = Matrix4::Identity();
    for (int j = 0; j < 6; ++j) {
      q[j] = angle(random);
      Matrix4 along = Matrix4::Identity(), out = Matrix4::Identity();
      along(0, 3) = a[j];
      out(2, 3) = d[j];
      pose = pose * turn('x', alpha[j]) * along * turn('z', q[j]) * out;
    }
    CHECK((forward_location(chain, q).tip - pose.topRightCorner<3, 1>()).norm() < 1e-5);
  }
  CHECK(says(from_ini(ini_text("genserkins", "ABCABC")), "MF203", "genserkins.A-0"));
}

TEST_CASE("import_linuxcnc: trivkins asks where rotaries are and joins gantry joints",
          "[machines][import]") {
  const std::string text =
      ini_text("trivkins coordinates=xyyzac", "XYYZAC",
               "[AXIS_Y]\nMIN_LIMIT = -50\nMAX_LIMIT = 900\nMAX_JERK = 5000\n");
  CHECK(says(from_ini(text), "MF205", "AC"));
  CHECK(says(from_ini(text, {{"A", "ceiling"}, {"C", "table"}}), "MF205", "A=ceiling"));
  const auto made = from_ini(text, {{"A", "table"}, {"C", "table"}, {"order", "C,A"}});
  const MachineDefinition m = machine_of(made);
  REQUIRE(m.size() == 5);
  CHECK(m.axes[1].name == "Y");
  CHECK(m.axes[1].joint.lower == -50.0);
  CHECK(m.axes[1].joint.upper == 150.0);
  CHECK(m.axes[1].source == LimitSource::datasheet);
  CHECK(m.axes[3].name == "C");
  CHECK(m.axes[3].joint.side == ChainSide::workpiece);
  CHECK(assumptions(made.value()).find("place of C, A") != std::string::npos);
  CHECK(machine_of(from_ini(ini_text("trivkins", "XYZ"))).size() == 3);
}

TEST_CASE("import_linuxcnc: what is not read is refused by name", "[machines][import]") {
  CHECK(says(from_ini(ini_text("pentakins", "XYZAC")), "MF202", "pentakins"));
  CHECK(says(from_ini("[KINS]\nJOINTS = 3\n"), "MF203", "KINEMATICS"));
  std::string text = ini_text("trivkins", "XYZ");
  text.replace(text.find("mm"), 2, "ell");
  CHECK(says(from_ini(text), "MF202", "LINEAR_UNITS"));
  CHECK(says(from_ini(ini_text("trivkins coordinates=XYZQ", "XYZQ")), "MF202", "letter Q"));
  CHECK(says(from_ini(ini_text("xyzac-trt-kins coordinates=XYZA", "XYZA")), "MF203", "lacks C"));
}

TEST_CASE("import_linuxcnc: LinuxCNC's own configurations are imported or refused by name",
          "[machines][import]") {
  namespace fs = std::filesystem;
  const fs::path root = "/usr/share/doc/linuxcnc/examples/sample-configs/sim";
  if (!fs::exists(root)) {
    WARN("LinuxCNC is not installed: skipped");
    return;
  }
  std::map<std::string, int> table;
  int count = 0;
  for (const auto& entry : fs::recursive_directory_iterator(root)) {
    if (entry.path().extension() != ".ini" || !entry.is_regular_file()) continue;
    INFO(entry.path());
    const ini::Source beside = [&](const std::string& name) -> std::optional<std::string> {
      const fs::path file = entry.path().parent_path() / name;
      if (!fs::is_regular_file(file)) return std::nullopt;
      return test::read_bytes(file);
    };
    const auto made = import_linuxcnc(test::read_bytes(entry.path()), entry.path().filename(),
                                      beside, {{"A", "table"}, {"B", "table"}, {"C", "head"}});
    ++count;
    REQUIRE(made.ok() != has_error(made.diagnostics()));
    if (made.ok()) {
      machine_of(made);
      ++table["imported"];
    } else {
      ++table[made.diagnostics().front().text.substr(0, 60)];
    }
  }
  for (const auto& [what, n] : table) WARN("LinuxCNC configurations: " << what << ": " << n);
  CHECK(count > 100);
  CHECK(2 * table["imported"] > count);
}

TEST_CASE("import_freecad: sides and order and velocities by the minute", "[machines][import]") {
  const auto axis = [](const std::string& name, const std::string& type, const std::string& role,
                       const std::string& vector, const std::string& parent) {
    return "\"" + name + "\": {\"type\": \"" + type + "\", \"role\": \"" + role +
           "\", \"joint\": {\"origin\": [0, 0, 7], \"axis\": " + vector +
           "}, \"parent\": " + parent +
           ", \"limits\": {\"min\": -100, \"max\": 120}, \"max_velocity\": 6000}";
  };
  const auto file = [&](const std::string& parent) {
    return "{\"machine\": {\"name\": \"M 1\", \"units\": \"imperial\", \"axes\": {" +
           axis("X", "linear", "table_linear", "[1, 0, 0]", "null") + "," +
           axis("Y", "linear", "head_linear", "[0, 1, 0]", "null") + "," +
           axis("Z", "linear", "head_linear", "[0, 0, 1]", "null") + "," +
           axis("A", "rotary", "table_rotary", "[1, 0, 0]", parent) + "," +
           axis("C", "rotary", "table_rotary", "[0, 0, 1]", "null") +
           "}}, \"postprocessor\": {\"file_name\": \"fanuc\"}}";
  };
  CHECK(says(import_freecad(file("null"), "m.fcm", {}), "MF205", "order=A,C"));
  const MachineDefinition by_parent = machine_of(import_freecad(file("\"C\""), "m.fcm", {}));
  CHECK(by_parent.axes[3].name == "C");
  const auto made = import_freecad(file("null"), "m.fcm", {{"order", "A,C"}});
  const MachineDefinition m = machine_of(made);
  CHECK(m.dialect.name == "fanuc_30i");
  REQUIRE(m.size() == 5);
  CHECK(m.axes[0].name == "Y");
  CHECK(m.axes[0].velocity == Approx(2540.0));  // 6000 inch by minute
  CHECK(m.axes[0].joint.upper == Approx(3048.0));
  const int x = m.axis_by_name("X"), a = m.axis_by_name("A");
  CHECK(m.axes[static_cast<std::size_t>(x)].joint.direction ==
        Vec3(-1, 0, 0));  // the table's motion
  CHECK(m.axes[static_cast<std::size_t>(a)].joint.direction == Vec3(-1, 0, 0));
  CHECK(m.axes[static_cast<std::size_t>(a)].joint.origin.z() == Approx(177.8));
  CHECK(a < m.axis_by_name("C"));
  CHECK(assumptions(made.value()).find("sign or place of A, C") != std::string::npos);
}
