#include <algorithm>
#include <array>
#include <cmath>

#include "formats/nc/executor.h"
#include "formats/nc/number.h"
#include "formats/nc/plane.h"
#include "kernels/core/units.h"

// Sinumerik: jumps to labels, arcs through a point, rotary positions by a sense, drilling cycles.
namespace smoothpost::nc {
namespace {

constexpr double kFlat = 1e-9;  // mm: the height of a triangle whose corners are on one line
constexpr double kTurn = 2.0 * kPi;

AxisMask bit(std::size_t axis) { return static_cast<AxisMask>(1u << axis); }

Vec3 xyz(const AxisWords& words) { return {words[0], words[1], words[2]}; }

/// The texts between the commas of a call's parentheses, without blanks at their ends.
std::vector<std::string_view> arguments_of(std::string_view statement) {
  const std::size_t open = statement.find('(');
  if (open == std::string_view::npos) return {};
  std::string_view rest = statement.substr(open + 1, statement.rfind(')') - open - 1);
  std::vector<std::string_view> out;
  int depth = 0;
  std::size_t begin = 0;
  for (std::size_t i = 0; i <= rest.size(); ++i) {
    const char c = i < rest.size() ? rest[i] : ',';
    if (c == '(') ++depth;
    if (c == ')') --depth;
    if (c != ',' || depth > 0) continue;
    std::string_view part = rest.substr(begin, i - begin);
    while (!part.empty() && detail::is_blank(part.front())) part.remove_prefix(1);
    while (!part.empty() && detail::is_blank(part.back())) part.remove_suffix(1);
    out.push_back(part);
    begin = i + 1;
  }
  return out;
}

}  // namespace

/// GOTOF goes to the next block of that label or number, GOTOB to the last one before, GOTO to the
/// next or, when there is none, the last before.
void Executor::go_to_label(const FlowStatement& statement) {
  const FlowIndex& index = index_of(*unit_);
  std::vector<std::uint32_t> blocks;
  const std::string& label = statement.text.label;
  const auto named = index.labels.find(label);
  if (named != index.labels.end()) {
    blocks = named->second;
  } else if (label.size() > 1 && label[0] == 'N') {
    for (const FlowIndex::Numbered& n : index.numbers)
      if ("N" + std::to_string(n.number) == label) blocks.push_back(n.block);
    std::sort(blocks.begin(), blocks.end());
  }
  const auto behind = std::upper_bound(blocks.begin(), blocks.end(), statement.block);
  const int direction = statement.text.direction;
  if (direction >= 0 && behind != blocks.end()) {
    place_.next = *behind;
  } else if (direction <= 0 && behind != blocks.begin()) {
    place_.next = behind[-1];
  } else {
    stop("NC250",
         "there is no block " + label +
             (direction > 0   ? " behind this one to go to"
              : direction < 0 ? " before this one to go to"
                              : " to go to"),
         flow_place(statement, 0));
  }
}

/// DC, ACP and ACN: a position of a rotary axis by the shorter way, upwards or downwards.
void Executor::turn_by_sense(const BlockWords& block, AxisWords& end) const {
  if (block.senses == 0) return;
  const AxisWords& here = coordinates_.world();
  for (std::size_t i = 3; i < 6; ++i) {
    const auto sense = static_cast<WordForm>(block.senses >> (8 * (i - 3)) & 0xffU);
    if (sense == WordForm::number || (coordinates_.unknown() & bit(i)) != 0) continue;
    double turn = std::remainder(end[i] - here[i], kTurn);
    if (sense == WordForm::upwards && turn < 0.0) turn += kTurn;
    if (sense == WordForm::downwards && turn > 0.0) turn -= kTurn;
    end[i] = here[i] + turn;
  }
}

/// CIP: the arc to X Y Z through I1 J1 K1, in any plane.
void Executor::point_arc(const BlockWords& block, const BlockPlan& plan) {
  begin_motion(block, plan);
  motion_.kind = MotionKind::feed;
  motion_.is_arc = true;
  motion_.end = target(block, plan.axes);
  motion_.unknown_end = unknown_at_target(block, plan.axes);
  if (modal_.tcp) turn_axis(block, plan);
  const AxisWords start = coordinates_.program_from_world(motion_.start);
  constexpr char kThrough[] = {kThroughX, kThroughY, kThroughZ};
  Vec3 through = xyz(start);
  for (int i = 0; i < 3; ++i) {
    if (!block.has(kThrough[i])) continue;
    const LetterMask letter = letter_bit(kThrough[i]);
    const bool absolute = (block.absolute & letter) != 0 ||
                          (!modal_.incremental && (block.incremental & letter) == 0);
    const double value = block[kThrough[i]] * modal_.unit;
    through[i] = absolute ? value : through[i] + value;
  }
  const Vec3 p0 = xyz(motion_.start);
  const Vec3 p1 = coordinates_.world_from_program(through);
  const Vec3 p2 = xyz(motion_.end);
  const Vec3 a = p1 - p0;
  const Vec3 b = p2 - p0;
  const Vec3 cross = a.cross(b);
  const double longest = std::max(a.norm(), b.norm());
  if (!(cross.norm() > kFlat * std::max(1.0, longest))) {
    log_.error("NC221",
               "CIP: start, the point I1 J1 K1 and the end lie on one line; write G1, or the point "
               "off the line",
               at(block, GGroup::motion));
    coordinates_.move_to(motion_.end, motion_.unknown_end);
    return;
  }
  // The centre of the circle through three points, from p0.
  const Vec3 centre = (cross.cross(a) * b.squaredNorm() + b.cross(cross) * a.squaredNorm()) /
                      (2.0 * cross.squaredNorm());
  const Vec3 normal = cross.normalized();
  const Vec3 from = -centre;
  const Vec3 to = b - centre;
  double sweep = std::atan2(normal.dot(from.cross(to)), from.dot(to));
  if (sweep <= 0.0) sweep += kTurn;
  motion_.arc.centre = p0 + centre;
  motion_.arc.normal = normal;
  motion_.arc.sweep = sweep;
  motion_.duration = duration_of(motion_, centre.norm() * sweep, block);
  finish_motion();
}

/// MCALL CYCLE81(..) and CYCLE82(..) from here on at every position, MCALL alone: no more; the call
/// alone: once, where the tool stands.
void Executor::define_drilling(const BlockWords& block, const BlockPlan& plan) {
  const std::string_view text = reader_.raw(block.statement_piece);
  const bool modal = block.says(SiemensWord::modal_call);
  const std::vector<std::string_view> arguments = arguments_of(text);
  modal_.drilling.reset();
  if (arguments.empty()) return;
  const bool dwells = upper_text(text).find("CYCLE82") != std::string::npos;
  const std::size_t most = dwells ? 6 : 5;
  std::array<std::optional<double>, 6> values;
  const auto refuse = [&](std::string why) {
    log_.error("NC260", std::string(dwells ? "CYCLE82: " : "CYCLE81: ") + std::move(why),
               reader_.place(block, block.statement_piece));
  };
  for (std::size_t i = 0; i < arguments.size(); ++i) {
    if (arguments[i].empty()) continue;
    const Evaluated found = values_->value(arguments[i]);
    if (!found.ok()) return refuse(found.problem);
    if (found.length != arguments[i].size()) return refuse("an argument has text behind its value");
    if (i < most) {
      values[i] = found.value;
    } else if (found.value != 0.0) {
      return refuse("its further arguments, which say how the others count, are read as 0 only");
    }
  }
  if (!values[0] || !values[1] || (!values[3] && !values[4]))
    return refuse("RTP, RFP and DP or DPR are needed");
  DrillingCall call;
  const double unit = modal_.unit;
  const double reference = *values[1] * unit;
  const double depth = values[4] ? reference - std::abs(*values[4]) * unit : *values[3] * unit;
  call.clearance = reference + std::abs(values[2].value_or(0.0)) * unit;
  call.retract = *values[0] * unit;
  call.depth = depth;
  call.dwell = values[5].value_or(0.0);
  if (call.dwell < 0.0) return refuse("a dwell in turns of the spindle is not read; write seconds");
  if (!(depth < reference) || call.retract < call.clearance)
    return refuse("the depth has to be below RFP, and RTP not below RFP and SDIS");
  if (modal) {
    modal_.drilling = call;
  } else {
    drill_by_call(block, plan, call);
  }
}

/// One hole where the tool stands.
void Executor::drill_by_call(const BlockWords& block, const BlockPlan& plan,
                             const DrillingCall& call) {
  const PlaneAxes plane = plane_axes(modal_.plane);
  if ((coordinates_.unknown() & 7) != 0) {
    log_.error("NC261", "a drilling cycle where X, Y or Z is not known: move there before",
               at(block, GGroup::motion));
    return;
  }
  if (modal_.tcp || modal_.inverse_time || !(modal_.linear_feed > 0.0)) {
    log_.error(
        "NC261",
        "a drilling cycle needs a feed by the minute (G94 F) and no TRAORI; write them before",
        at(block, GGroup::motion));
    return;
  }
  AxisWords program = coordinates_.program_from_world(coordinates_.world());
  const auto go = [&](double height, MotionKind kind) {
    program[plane.third] = height;
    cycle_move(block, plan, kind, program);
  };
  go(call.clearance, MotionKind::rapid);
  go(call.depth, MotionKind::feed);
  if (call.dwell > 0.0) sink_.dwell(call.dwell, block.input_line);
  go(call.retract, MotionKind::rapid);
}

}  // namespace smoothpost::nc
