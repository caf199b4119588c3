#include "postproc/pipeline/controller_blending.h"

#include <catch2/catch.hpp>
#include <random>

#include "kernels/core/units.h"
#include "machines/dialects/krl.h"
#include "postproc/pipeline/convert.h"
#include "postproc/pipeline/tool_motion.h"
#include "tests/postproc/pipeline/paths.h"

using namespace smoothpost;
using namespace smoothpost::test;

namespace {

MachineDefinition robot(const std::string& path_mode) {
  MachineDefinition machine = shipped_machine("robot_6r");
  machine.dialect.path_mode = path_mode;
  machine.process.events.push_back({"beam_on", "$OUT[1]=TRUE", true, 0.0, 0.0});
  machine.process.events.push_back({"beam_off", "$OUT[1]=FALSE", true, 0.0, 0.0});
  machine.process.events.push_back({"pierce", "$OUT[3]=TRUE", true, 0.3, 0.0});
  return machine;
}

Vec3 random_vector(std::mt19937& rng, double size) {
  std::normal_distribution<double> normal;
  return size * Vec3(normal(rng), normal(rng), normal(rng));
}

double uniform(std::mt19937& rng, double low, double high) {
  return std::uniform_real_distribution<double>(low, high)(rng);
}

std::vector<BlendAllowance> allowances(const ReadBack& read, const MachineDefinition& machine,
                                       double tool_length = 0.0) {
  return blend_allowances(read, chain_of(machine), [=](std::size_t) { return tool_length; });
}

ReadBack tool_moves(const std::vector<Pose>& poses) {
  ReadBack read;
  for (const Pose& pose : poses) {
    ReadBackMove move;
    move.to = JointVector::Zero(6);
    move.interpolation = MoveInterpolation::tool;
    move.tool = pose;
    read.moves.push_back(move);
  }
  return read;
}

Pose pose_at(const Vec3& place, const Mat3& rotation) {
  Pose pose = Pose::Identity();
  pose.translation() = place;
  pose.linear() = rotation;
  return pose;
}

double turn_between(const Mat3& a, const Mat3& b) { return rotation_log(a.transpose() * b).norm(); }

// A path of moves with lengths and turns that vary: gentle, with a corner now and then.
std::vector<Pose> wandering(std::mt19937& rng, int count) {
  std::vector<Pose> poses = {pose_at(Vec3(10, 20, 30), rotation_exp(random_vector(rng, 0.5)))};
  Vec3 direction = random_vector(rng, 1.0).normalized();
  Vec3 rate = random_vector(rng, 1e-3);
  const double scale = std::pow(10.0, uniform(rng, -1.0, 1.5));
  for (int i = 0; i < count; ++i) {
    const bool corner = uniform(rng, 0.0, 1.0) < 0.15;
    direction = (direction + random_vector(rng, corner ? 1.0 : 0.01)).normalized();
    rate = corner ? random_vector(rng, 1e-3) : Vec3(rate + random_vector(rng, 1e-5));
    const double length = scale * uniform(rng, 0.5, 2.0);
    poses.push_back(pose_at(poses.back().translation() + length * direction,
                            rotation_exp(length * rate) * poses.back().linear()));
  }
  return poses;
}

MachineProgram program_along(const std::vector<Pose>& poses, const MachineDefinition& machine) {
  MachineProgram program;
  program.tool_length = 80.0;
  const auto add = [&](MachineMove move) {
    move.tool_length = program.tool_length;
    program.moves.push_back(std::move(move));
  };
  MachineMove start;
  start.to = JointVector::Zero(machine.size());
  start.joints = (1U << machine.size()) - 1U;
  start.rapid = true;
  start.role = MoveRole::link;
  add(start);
  for (const Pose& pose : poses) {
    MachineMove move = start;
    move.interpolation = MoveInterpolation::tool;
    move.joints = 0;
    move.tool = pose;
    move.rapid = false;
    move.role = MoveRole::path;
    move.duration = 0.5;
    add(move);
  }
  return program;
}

ReadBack through_text(const MachineDefinition& machine, const MachineProgram& program) {
  const auto emitted = krl::emit(machine, program);
  for (const auto& d : emitted.diagnostics()) UNSCOPED_INFO(to_string(d));
  REQUIRE(emitted.ok());
  auto back = krl::read_back(machine, emitted.value().text, "out.src");
  for (const auto& d : back.diagnostics()) UNSCOPED_INFO(to_string(d));
  REQUIRE(back.ok());
  REQUIRE(back.value().moves.size() == program.moves.size());
  return back.value();
}

MachineAction action(MachineAction::Kind kind, std::size_t before, const std::string& event = "") {
  MachineAction a;
  a.kind = kind;
  a.before = before;
  a.event.name = event;
  a.text = "text";
  a.seconds = 0.1;
  return a;
}

double angle_at(const std::vector<Pose>& poses, std::size_t i) {
  return angle_between((poses[i].translation() - poses[i - 1].translation()).normalized(),
                       (poses[i + 1].translation() - poses[i].translation()).normalized());
}

}  // namespace

TEST_CASE("blending: curves in the hull of a corner keep the allowance in a monotone matching",
          "[pipeline]") {
  std::mt19937 rng(401);
  const auto machine = robot("blend");
  double nearest = 0.0;
  for (int round = 0; round < 300; ++round) {
    const Pose corner = pose_at(random_vector(rng, 50.0), rotation_exp(random_vector(rng, 1.0)));
    const Vec3 t0 = random_vector(rng, 1.0).normalized(), t1 = random_vector(rng, 1.0).normalized();
    const Vec3 w0 = random_vector(rng, 5e-3), w1 = random_vector(rng, 5e-3);
    const double l0 = uniform(rng, 10.0, 100.0), l1 = uniform(rng, 10.0, 100.0);
    const double radius = uniform(rng, 0.1, 5.0);
    // The straight way from the definition: u mm behind the corner, negative in front of it.
    const auto straight = [&](double u) {
      return pose_at(corner.translation() + u * (u < 0.0 ? t0 : t1),
                     rotation_exp(u * (u < 0.0 ? w0 : w1)) * corner.linear());
    };
    auto read = tool_moves({straight(-l0), corner, straight(l1)});
    read.moves[1].blend = radius;
    const auto allowed = allowances(read, machine);
    CHECK(allowed[0].tip == 0.0);
    CHECK(allowed[1].tip == allowed[2].tip);
    CHECK(allowed[1].rotation == allowed[2].rotation);
    const double power = uniform(rng, 1.0, 4.0), smaller = uniform(rng, 0.1, 1.0);
    for (const double exponent : {1.0, 2.0, power}) {
      double last = -1.0;
      for (int k = 0; k <= 200; ++k) {
        const double s = k / 200.0;
        const double a = std::pow(1.0 - s, exponent), b = std::pow(s, exponent);
        const double r = smaller * radius;  // a control may round less
        const Pose on_curve = pose_at(corner.translation() - a * r * t0 + b * r * t1,
                                      rotation_exp(-a * r * w0 + b * r * w1) * corner.linear());
        CHECK(b - a >= last);  // matched in order
        last = b - a;
        const Pose matched = straight(r * (b - a));
        const double tip = (on_curve.translation() - matched.translation()).norm();
        const double turn = turn_between(on_curve.linear(), matched.linear());
        REQUIRE(tip <= allowed[1].tip * (1 + 1e-9) + 1e-12);
        REQUIRE(turn <= allowed[1].rotation * (1 + 1e-9) + 1e-12);
        nearest = std::max(nearest, tip / allowed[1].tip);
      }
    }
  }
  CHECK(nearest > 0.98);  // the bound is no wider than it has to be
}

TEST_CASE("blending: a right angle from the definition", "[pipeline]") {
  const Mat3 none = Mat3::Identity();
  auto read = tool_moves({pose_at(Vec3(0, 0, 0), none), pose_at(Vec3(10, 0, 0), none),
                          pose_at(Vec3(10, 10, 0), rotation_exp(Vec3(0, 0, 0.2)))});
  read.moves[1].blend = 2.0;
  const auto allowed = allowances(read, robot("blend"));
  // Half of the triangle's height over the chord of the two tangent points is at the chord's
  // middle.
  CHECK(allowed[1].tip == Approx(2.0 * std::sin(kPi / 4.0)));
  CHECK(allowed[1].rotation == Approx(0.5 * 2.0 * 0.02));
}

TEST_CASE("blending: the Catmull-Rom curve keeps half the allowance at equal parameter",
          "[pipeline]") {
  std::mt19937 rng(402);
  const auto machine = robot("spline");
  double nearest = 0.0;
  for (int round = 0; round < 200; ++round) {
    const auto poses = wandering(rng, 12);
    auto read = tool_moves(poses);
    for (std::size_t i = 1; i < poses.size(); ++i) read.moves[i].spline = true;
    const auto allowed = allowances(read, machine);
    std::vector<double> knots = {0.0};
    for (std::size_t i = 1; i < poses.size(); ++i)
      knots.push_back(knots.back() + (poses[i].translation() - poses[i - 1].translation()).norm());
    for (std::size_t i = 2; i + 1 < poses.size(); ++i)
      for (int k = 0; k <= 20; ++k) {
        // Barry and Goldman's pyramid for the span between points i-1 and i.
        const double t = knots[i - 1] + k / 20.0 * (knots[i] - knots[i - 1]);
        std::vector<Vec3> level;
        for (std::size_t p = i - 2; p <= i + 1; ++p) level.push_back(poses[p].translation());
        const auto blend = [&](const std::vector<Vec3>& in, std::size_t width) {
          std::vector<Vec3> out;
          for (std::size_t n = 0; n + 1 < in.size(); ++n) {
            std::size_t lower = i - 2 + n, upper = lower + width;
            if (width == 2 && in.size() == 2) lower = i - 1, upper = i;
            const double share = (t - knots[lower]) / (knots[upper] - knots[lower]);
            out.push_back((1.0 - share) * in[n] + share * in[n + 1]);
          }
          return out;
        };
        const Vec3 on_curve = blend(blend(blend(level, 1), 2), 2)[0];
        const Vec3 on_chord = poses[i - 1].translation() +
                              k / 20.0 * (poses[i].translation() - poses[i - 1].translation());
        const double off = (on_curve - on_chord).norm();
        REQUIRE(off <= 0.5 * allowed[i].tip + 1e-9);
        if (allowed[i].tip > 0.0) nearest = std::max(nearest, off / (0.5 * allowed[i].tip));
      }
  }
  CHECK(nearest > 0.7);
}

TEST_CASE("blending: a rotation laid through the points in the same way keeps the allowance",
          "[pipeline]") {
  std::mt19937 rng(403);
  const auto machine = robot("spline");
  for (int round = 0; round < 200; ++round) {
    const auto poses = wandering(rng, 8);
    auto read = tool_moves(poses);
    for (std::size_t i = 1; i < poses.size(); ++i) read.moves[i].spline = true;
    const auto allowed = allowances(read, machine);
    std::vector<Vec3> turn(poses.size(), Vec3::Zero());
    std::vector<double> length(poses.size(), 0.0);
    for (std::size_t i = 1; i < poses.size(); ++i) {
      turn[i] = rotation_log(poses[i].linear() * poses[i - 1].linear().transpose());
      length[i] = (poses[i].translation() - poses[i - 1].translation()).norm();
    }
    // Rates at the points as the parabola through three of them has them; at the ends straight on.
    const auto rate = [&](std::size_t p) -> Vec3 {
      if (p == 0) return turn[1] / length[1];
      if (p + 1 == poses.size()) return turn[p] / length[p];
      return (length[p + 1] * turn[p] / length[p] + length[p] * turn[p + 1] / length[p + 1]) /
             (length[p] + length[p + 1]);
    };
    for (std::size_t i = 1; i < poses.size(); ++i)
      for (int k = 0; k <= 20; ++k) {
        const double t = k / 20.0, v = 1.0 - t;
        const Vec3 vector = t * turn[i] + t * v * v * (length[i] * rate(i - 1) - turn[i]) -
                            t * t * v * (length[i] * rate(i) - turn[i]);
        const double off = turn_between(rotation_exp(vector), rotation_exp(t * turn[i]));
        REQUIRE(off <= 0.5 * allowed[i].rotation * (1 + 1e-6) + 1e-12);
      }
  }
}

TEST_CASE("blending: planned programs keep the controller's share as printed", "[pipeline]") {
  std::mt19937 rng(404);
  for (const std::string mode : {"exact", "blend", "spline"}) {
    auto machine = robot(mode);
    const double tip = machine.tolerance.tip * machine.tolerance.budget.controller;
    const double axis = machine.tolerance.axis * machine.tolerance.budget.controller;
    std::size_t rounded = 0, splined = 0, straight = 0;
    double worst = 0.0;
    for (int round = 0; round < 120; ++round) {
      machine.dialect.digits_length = round % 3 == 0 ? 3 : 4;
      auto program = program_along(wandering(rng, 60), machine);
      plan_blending(program, machine, chain_of(machine));
      const auto read = through_text(machine, program);
      CHECK(read.exact_path);
      const auto allowed = allowances(read, machine, program.tool_length);
      for (std::size_t i = 0; i < allowed.size(); ++i) {
        REQUIRE(allowed[i].tip <= tip);
        REQUIRE(allowed[i].rotation <= axis);
        worst = std::max({worst, allowed[i].tip / tip, allowed[i].rotation / axis});
        rounded += read.moves[i].blend > 0.0 ? 1U : 0U;
        splined += read.moves[i].spline ? 1U : 0U;
        straight += allowed[i].tip == 0.0 ? 1U : 0U;
        CHECK(read.moves[i].blend <= program.moves[i].blend);
        CHECK(read.moves[i].spline == program.moves[i].spline);
      }
    }
    CHECK((rounded > 4000) == (mode == "blend"));
    CHECK((splined > 1000) == (mode == "spline"));
    CHECK((worst > 0.8) == (mode != "exact"));
    CHECK(straight > 0);
    CHECK(blending_assumption(mode).empty() == (mode == "exact"));
  }
}

TEST_CASE("blending: the radius is the largest that the budget and the moves allow", "[pipeline]") {
  const auto machine = robot("blend");
  const double tip = machine.tolerance.tip * machine.tolerance.budget.controller;
  const Mat3 none = Mat3::Identity();
  const auto radius = [&](double degrees, double length) {
    const double angle = radians_from_degrees(degrees);
    auto program =
        program_along({pose_at(Vec3(-length, 0, 0), none), pose_at(Vec3(0, 0, 0), none),
                       pose_at(length * Vec3(std::cos(angle), std::sin(angle), 0), none)},
                      machine);
    plan_blending(program, machine, chain_of(machine));
    CHECK(program.moves[1].blend == 0.0);  // its start turns the tool
    CHECK(program.moves[3].blend == 0.0);  // nothing behind it
    return program.moves[2].blend;
  };
  CHECK(radius(90.0, 1000.0) == Approx(tip / std::sin(kPi / 4.0)).epsilon(0.01));
  CHECK(radius(10.0, 1000.0) == Approx(tip / std::sin(radians_from_degrees(5.0))).epsilon(0.01));
  CHECK(radius(0.0, 10.0) == Approx(4.9).epsilon(0.01));
  CHECK(radius(0.0, 1000.0) == 20.0);
  CHECK(radius(125.0, 1000.0) == 0.0);
  CHECK(radius(180.0, 1000.0) == 0.0);
  CHECK(radius(90.0, 1e-4) == 0.0);
}

TEST_CASE("blending: what stops the robot stays exact", "[pipeline]") {
  using Kind = MachineAction::Kind;
  std::vector<Pose> line;
  for (int i = 0; i < 7; ++i) line.push_back(pose_at(Vec3(10.0 * i, 0, 0), Mat3::Identity()));
  for (const std::string mode : {"blend", "spline"}) {
    const auto machine = robot(mode);
    const auto passes = [&](const std::function<void(MachineProgram&)>& change) {
      auto program = program_along(line, machine);
      change(program);
      plan_blending(program, machine, chain_of(machine));
      return mode == "blend" ? program.moves[4].blend > 0.0
                             : program.moves[4].spline && program.moves[5].spline;
    };
    const auto with = [&](const MachineAction& a) {
      return passes([&](MachineProgram& p) { p.actions = {a}; });
    };
    INFO(mode);
    CHECK(passes([](MachineProgram&) {}));
    CHECK(with(action(Kind::comment, 5)));
    CHECK(with(action(Kind::event, 5, "beam_on")));
    CHECK_FALSE(with(action(Kind::event, 5, "pierce")));       // dwells
    CHECK_FALSE(with(action(Kind::event, 5, "spindle_off")));  // stops
    CHECK_FALSE(with(action(Kind::event, 5, "gas_on")));       // no words
    CHECK_FALSE(with(action(Kind::dwell, 5)));
    CHECK_FALSE(with(action(Kind::cut_label, 5)));
    CHECK_FALSE(passes([](MachineProgram& p) { p.moves[5].rapid = true; }));
    CHECK_FALSE(passes([](MachineProgram& p) { p.moves[5].role = MoveRole::link; }));
    CHECK_FALSE(passes([](MachineProgram& p) { p.moves[5].tool_length += 1.0; }));
    CHECK_FALSE(
        passes([](MachineProgram& p) { p.moves[5].interpolation = MoveInterpolation::joints; }));
    CHECK_FALSE(passes([](MachineProgram& p) { p.moves[5].tool = p.moves[4].tool; }));
  }
}

TEST_CASE("blending: chains of a spline are parted by a straight move at a corner", "[pipeline]") {
  std::mt19937 rng(405);
  auto machine = robot("spline");
  machine.tolerance.axis = 1.0;  // the turn decides nothing here
  std::size_t chains = 0;
  for (int round = 0; round < 100; ++round) {
    const auto poses = wandering(rng, 80);
    auto program = program_along(poses, machine);
    plan_blending(program, machine, chain_of(machine));
    for (std::size_t i = 1; i < program.moves.size(); ++i) {
      const bool before = program.moves[i - 1].spline;
      if (!program.moves[i].spline) continue;
      chains += before ? 0 : 1;
      const bool behind = i + 1 < program.moves.size() && program.moves[i + 1].spline;
      CHECK((before || behind));  // no block of one point
      // Move i ends at poses[i - 1].
      if (behind) CHECK(angle_at(poses, i - 1) <= radians_from_degrees(45.0));
    }
  }
  CHECK(chains > 100);
}

TEST_CASE("blending: what has no bound says so", "[pipeline]") {
  const auto machine = robot("blend");
  const Mat3 none = Mat3::Identity();
  const auto moves = [&] {
    return tool_moves({pose_at(Vec3(0, 0, 0), none), pose_at(Vec3(10, 0, 0), none),
                       pose_at(Vec3(10, 10, 0), none)});
  };
  auto joint = moves();
  joint.moves[1].blend = 1.0;
  joint.moves[2].interpolation = MoveInterpolation::joints;
  CHECK(std::isinf(allowances(joint, machine)[1].tip));
  CHECK(std::isinf(allowances(joint, machine)[2].rotation));
  auto end = moves();
  end.moves[2].blend = 1.0;
  CHECK(std::isinf(allowances(end, machine)[2].tip));
  auto unknown = moves();
  unknown.moves[0].blend = 1.0;  // where it starts is not known
  CHECK(std::isinf(allowances(unknown, machine)[1].tip));
  auto turning = moves();
  turning.moves[1].tool = pose_at(Vec3(0, 0, 0), rotation_exp(Vec3(0.1, 0, 0)));
  turning.moves[1].spline = turning.moves[2].spline = true;
  CHECK(std::isinf(allowances(turning, machine)[1].tip));
  CHECK(std::isinf(allowances(turning, machine)[2].tip));
  // A rounding wider than its moves reaches the next ones too.
  auto wide = tool_moves({pose_at(Vec3(0, 0, 0), none), pose_at(Vec3(9, 0, 0), none),
                          pose_at(Vec3(10, 0, 0), none), pose_at(Vec3(10, 1, 0), none),
                          pose_at(Vec3(10, 9, 0), none)});
  wide.moves[2].blend = 2.0;
  for (std::size_t i = 1; i < 5; ++i)
    CHECK(allowances(wide, machine)[i].tip == Approx(2.0 * std::sin(kPi / 4.0)));
}

TEST_CASE("blending: a move behind a joint move starts where the chain stands", "[pipeline]") {
  std::mt19937 rng(406);
  const auto machine = robot("blend");
  const auto chain = chain_of(machine);
  ReadBack read;
  ReadBackMove joint;
  joint.to = JointVector(6);
  joint.to << 0.1, -1.4, 1.5, 0.2, 0.7, -0.3;
  const Pose start = tip_pose(chain, joint.to, 80.0);
  read = tool_moves({start, start * pose_at(Vec3(10, 0, 0), Mat3::Identity()),
                     start * pose_at(Vec3(10, 10, 0), Mat3::Identity())});
  read.moves[0].interpolation = MoveInterpolation::joints;
  read.moves[0].to = joint.to;
  read.moves[0].tool = Pose::Identity();
  read.moves[1].blend = 2.0;
  CHECK(allowances(read, machine, 80.0)[1].tip == Approx(2.0 * std::sin(kPi / 4.0)));
}

TEST_CASE("blending: a program with a latency is certified in every path mode", "[pipeline]") {
  // A wave with a corner and with the beam going on and off within it.
  std::string text = "%\nM428\nG21 G90 G17 G94\nG54\nG0 X-60 Y0 Z60 C0 B0\nG0 Z1\n";
  for (int i = 0; i <= 60; ++i) {
    const double x = -60.0 + 2.0 * i,
                 y = 12.0 * std::sin(0.1 * i) + (i > 30 ? 2.0 * (i - 30) : 0.0);
    if (i == 10 || i == 40) text += "M62 P0\n";
    if (i == 25 || i == 55) text += "M63 P0\n";
    text += "G1 X" + std::to_string(x) + " Y" + std::to_string(y) + " Z1 C0 B" +
            std::to_string(0.2 * i) + " F3000\n";
  }
  text += "G0 Z60\nM429\nM30\n%\n";
  for (const std::string mode : {"exact", "blend", "spline"}) {
    ConvertInput in;
    in.input = read_program(text, "laser_5p1");
    in.input_name = "part.ngc";
    in.machine = robot(mode);
    for (auto& row : in.machine.process.events) row.latency = row.on_the_fly ? 0.0083 : 0.0;
    in.placement = shifted(0, 0, 0);
    const Conversion c = convert(in, false, {});
    for (const auto& d : c.diagnostics) UNSCOPED_INFO(to_string(d));
    INFO(mode << "\n" << c.program);
    CHECK(c.verdict == Verdict::certified);
    CHECK((c.program.find(" C_DIS") != std::string::npos) == (mode == "blend"));
    CHECK((c.program.find("ENDSPLINE") != std::string::npos) == (mode == "spline"));
    if (mode != "spline") CHECK(c.program.find(" DELAY=-8 DO ") != std::string::npos);
  }
}
