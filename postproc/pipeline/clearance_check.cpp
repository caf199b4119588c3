#include "postproc/pipeline/clearance_check.h"

#include <algorithm>
#include <cmath>

#include "kernels/collision/motion_check.h"
#include "machines/definition/body_pairs.h"
#include "machines/dialects/decimal.h"
#include "postproc/pipeline/conversion_parts.h"

namespace smoothpost {

namespace {

constexpr std::size_t kMovesBetweenAsking = 64;  // for progress
constexpr double kArm = 1000.0;                  // mm, from a rotation's centre to a body
constexpr double kFirstCap = 1000.0;             // mm: farther distances are not told apart

const char* kPartName = "part";

JointMask all_joints(const MachineDefinition& machine) {
  return (JointMask{1} << machine.size()) - 1U;
}

std::string number(double value) {
  std::string text;
  append_decimal(text, value, 3);
  return text;
}

/// A rapid whose axes do not arrive together may be anywhere between the ends of each.
JointVector wandering(const JointVector& from, const ReadBackMove& move,
                      const MachineDefinition& machine) {
  if (!move.rapid || machine.links.rapid != RapidMotion::independent) return {};
  const JointVector travel = (move.to - from).cwiseAbs();
  if ((travel.array() > 0.0).count() <= 1) return {};
  return travel;
}

}  // namespace

Result<std::optional<Scene>> machine_scene(const SceneInput& in) {
  using Out = Result<std::optional<Scene>>;
  std::vector<BodyPair> wanted = checked_pairs(in.machine);
  if (in.part == nullptr)
    std::erase_if(wanted, [](const BodyPair& p) { return p.second == BodyPair::kPart; });
  if (wanted.empty()) return Out(std::optional<Scene>{});
  std::vector<SceneBody> bodies;
  for (const Body& body : in.machine.bodies) {
    auto shape = shape_of(body);
    if (!shape.ok()) return Out::failure(shape.diagnostics());
    const int joint = joint_carrying(in.machine, body.link);
    bodies.push_back({body.name, joint < 0 ? SceneBody::kBase : joint, std::move(shape.value())});
  }
  const std::size_t part = bodies.size();
  if (in.part != nullptr) {
    std::shared_ptr<const TriangleTree> tree = in.tree;
    if (!tree) {
      auto built = build_triangle_tree(*in.part);
      if (!built.ok()) return Out::failure(built.diagnostics());
      tree = std::make_shared<const TriangleTree>(std::move(built.value()));
    }
    bodies.push_back({kPartName, SceneBody::kWorkpiece, mesh_shape(std::move(tree), *in.part)});
  }
  std::vector<ScenePair> pairs;
  for (const BodyPair& pair : wanted)
    pairs.push_back({pair.first, pair.second == BodyPair::kPart ? part : pair.second,
                     pair.clearance + in.allowance});
  return Out(std::optional<Scene>(Scene(in.chain, std::move(bodies), std::move(pairs))));
}

ClearanceReport check_clearance(const Scene& scene, const ReadBack& joints,
                                const MachineDefinition& machine, const Progress& progress) {
  ClearanceReport out;
  out.least = kFirstCap;
  SceneCache cache;
  const JointMask all = all_joints(machine);
  for (std::size_t i = 0; i < joints.moves.size(); ++i) {
    const ReadBackMove& move = joints.moves[i];
    if ((move.known & all) != all) continue;
    const Clearance end = scene.clearance(move.to, out.least, &cache);
    if (end.pair != Clearance::kNoPair && end.margin < out.least) {
      out.least = end.margin;
      out.least_pair = end.pair;
      out.least_move = i;
    }
    if (i == 0 || (joints.moves[i - 1].known & all) != all) continue;
    const JointVector& from = joints.moves[i - 1].to;
    MotionSettings settings;
    settings.deviation =
        move.deviation.size() > 0 ? JointVector(move.deviation) : wandering(from, move, machine);
    const MotionReport report = check_motion(scene, from, move.to, settings, &cache);
    if (report.verdict != MotionVerdict::free) {
      ++out.moves;
      if (out.places.size() < ClearanceReport::kPlaces)
        out.places.push_back({i, report.t, report.pair, report.at.found ? report.at.distance : 0.0,
                              report.at.on_second, report.verdict == MotionVerdict::undecided});
    }
    if (i % kMovesBetweenAsking == 0 &&
        !progress("clearance", static_cast<double>(i) / static_cast<double>(joints.moves.size()))) {
      // Cancelled: what comes now is not proven.
      ++out.moves;
      out.places.push_back({i, 0.0, 0, 0.0, Vec3::Zero(), true});
      break;
    }
  }
  out.queries = cache.queries();
  out.skipped = cache.skipped();
  return out;
}

double largest_allowance(const std::vector<BlendAllowance>& rounding,
                         const MachineDefinition& machine, bool tool_moves) {
  double most = 0.0;
  for (const BlendAllowance& a : rounding) most = std::max(most, a.tip + kArm * a.rotation);
  if (tool_moves) most += kStepShare * (machine.tolerance.tip + kArm * machine.tolerance.axis);
  return most;
}

int standoff_joint(const MachineDefinition& machine) {
  return machine.standoff.axis.empty() ? -1 : machine.axis_by_name(machine.standoff.axis);
}

int towards_wrist(const MachineDefinition& machine) {
  const int joint = standoff_joint(machine);
  if (joint < 0) return 0;
  const Vec3& along = machine.axes[static_cast<std::size_t>(joint)].joint.direction;
  return along.dot(machine.tool.axis) > 0.0 ? 1 : -1;
}

Check clearance_check(const ClearanceReport& report, const Scene& scene, const ReadBack& joints) {
  Check c;
  c.name = "clearance";
  c.unit = "mm";
  std::size_t pair = report.least_pair;
  c.value = report.least;
  c.output_line = joints.moves.empty() ? 0 : joints.moves[report.least_move].line;
  if (pair != Clearance::kNoPair) {
    c.limit = scene.pairs()[pair].clearance;
    c.value = std::max(0.0, report.least + c.limit);
  }
  c.ok = report.moves == 0;
  if (!c.ok) {
    const ClearancePlace& first = report.places.front();
    pair = first.pair;
    c.limit = scene.pairs()[pair].clearance;
    c.value = std::min(first.distance, c.limit);
    c.output_line = joints.moves[first.move].line;
    c.note = std::to_string(report.moves) +
             " motions are not free: " + place_texts(report, scene).front();
    return c;
  }
  if (pair == Clearance::kNoPair) {
    c.note = "from below: everything stays farther apart";
    return c;
  }
  const ScenePair& p = scene.pairs()[pair];
  c.note = "tightest at the ends of motions: " + scene.bodies()[p.first].name + " and " +
           scene.bodies()[p.second].name + "; between the ends proven above the limit";
  return c;
}

std::vector<std::string> place_texts(const ClearanceReport& report, const Scene& scene) {
  std::vector<std::string> texts;
  for (const ClearancePlace& place : report.places) {
    const ScenePair& pair = scene.pairs()[place.pair];
    std::string text = scene.bodies()[pair.first].name + " and " + scene.bodies()[pair.second].name;
    if (place.undecided)
      text += " are not proven to stay " + number(pair.clearance) + " mm apart";
    else if (place.distance <= 0.0)
      text += " meet";
    else
      text += " come to " + number(place.distance) + " mm, " + number(pair.clearance) +
              " mm are required";
    text += ", near x " + number(place.point.x()) + " y " + number(place.point.y()) + " z " +
            number(place.point.z()) + " of the program";
    texts.push_back(std::move(text));
  }
  return texts;
}

}  // namespace smoothpost
