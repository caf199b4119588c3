#include "postproc/pipeline/link_check.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "kernels/core/units.h"
#include "postproc/pipeline/tool_motion.h"

namespace smoothpost {

namespace {

constexpr double kStepLength = 2.0;  // mm
constexpr double kStepAngle = 2.0 * kRadiansPerDegree;

class LinkDepth {
 public:
  LinkDepth(const ReadBack& read, const LinkDepthInput& in)
      : read_(read), in_(in), retract_(in.machine.axis_by_name(in.machine.links.retract_axis)) {
    tool_side_only_ =
        std::all_of(in.chain.joints.begin(), in.chain.joints.end(),
                    [](const ChainJoint& joint) { return joint.side == ChainSide::tool; });
  }

  Check run() {
    const JointMask all = (1U << in_.chain.size()) - 1U;
    std::size_t first = 0;
    while (first < read_.moves.size() && read_.moves[first].known != all) ++first;
    for (std::size_t i = first + 1; i < read_.moves.size(); ++i) {
      if (!is_link(i)) continue;
      const std::size_t begin = i;
      while (i + 1 < read_.moves.size() && is_link(i + 1)) ++i;
      see_link(begin, i, begin > first + 1);
    }
    Check c;
    c.name = "link_depth";
    c.unit = "mm";
    c.value = deepest_;
    c.limit = in_.machine.tolerance.tip;
    c.ok = c.value <= c.limit;
    c.output_line = line_;
    if (!c.ok)
      c.note =
          "between two cuts the tool goes deeper than it is at both of their ends, below the "
          "retract plane";
    return c;
  }

 private:
  bool is_link(std::size_t i) const {
    return read_.moves[i].rapid || (in_.beam && !read_.moves[i].beam);
  }

  CutterLocation at(const JointVector& q) const {
    const Pose pose = tip_pose(in_.chain, q, in_.tool_length);
    return {pose.translation(), pose.linear() * in_.chain.tool_axis};
  }

  bool over_plane(const JointVector& q) const {
    const LinkSettings& links = in_.machine.links;
    const DialectSettings& dialect = in_.machine.dialect;
    const double half_digit = 0.5 * std::pow(10.0, -dialect.digits_length) *
                              (dialect.units == "inch" ? kMillimetresPerInch : 1.0);
    if (retract_ >= 0) {
      const ChainJoint& joint = in_.chain.joints[static_cast<std::size_t>(retract_)];
      return links.retract >= 0.5 * (joint.lower + joint.upper)
                 ? q[retract_] >= links.retract - half_digit
                 : q[retract_] <= links.retract + half_digit;
    }
    return links.has_plane && tool_side_only_ &&
           (in_.chain.workpiece_home * at(q).tip).z() >= links.retract - in_.machine.tolerance.tip;
  }

  static double below(const CutterLocation& here, const CutterLocation& end) {
    const Vec3 down = end.tip - here.tip;
    return std::min(down.dot(here.axis), down.dot(end.axis));
  }

  void see_link(std::size_t begin, std::size_t end, bool after_cut) {
    std::vector<CutterLocation> ends;
    if (after_cut) ends.push_back(at(read_.moves[begin - 1].to));
    if (end + 1 < read_.moves.size()) ends.push_back(at(read_.moves[end].to));
    if (ends.empty()) return;
    for (std::size_t i = begin; i <= end; ++i) {
      const JointVector& from = read_.moves[i - 1].to;
      const JointVector& to = read_.moves[i].to;
      if (over_plane(from) && over_plane(to)) continue;
      const int steps = steps_of(from, to);
      for (int k = 0; k <= steps; ++k) {
        const JointVector q = from + static_cast<double>(k) / steps * (to - from);
        if (over_plane(q)) continue;
        double depth = INFINITY;
        for (const CutterLocation& e : ends) depth = std::min(depth, below(at(q), e));
        if (depth <= deepest_) continue;
        deepest_ = depth;
        line_ = read_.moves[i].line;
      }
    }
  }

  int steps_of(const JointVector& from, const JointVector& to) const {
    double steps = 1.0;
    for (int j = 0; j < in_.chain.size(); ++j) {
      const bool rotary = in_.chain.joints[static_cast<std::size_t>(j)].kind == JointKind::rotary;
      steps = std::max(steps, std::abs(to[j] - from[j]) / (rotary ? kStepAngle : kStepLength));
    }
    return static_cast<int>(std::min(std::ceil(steps), 1e5));
  }

  const ReadBack& read_;
  const LinkDepthInput& in_;
  int retract_ = -1;
  bool tool_side_only_ = false;
  double deepest_ = 0.0;
  std::uint32_t line_ = 0;
};

}  // namespace

Check link_depth_check(const ReadBack& read, const LinkDepthInput& input) {
  return LinkDepth(read, input).run();
}

}  // namespace smoothpost
