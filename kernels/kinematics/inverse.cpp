#include "kernels/kinematics/inverse.h"

#include <algorithm>
#include <cmath>

#include "kernels/core/units.h"

namespace smoothpost {

std::optional<Inverse> Inverse::from(const ScrewChain& chain) {
  if (auto pair = RotaryPair::from(chain)) return Inverse(std::move(*pair));
  if (auto arm = SixR::from(chain)) return Inverse(std::move(*arm));
  return {};
}

const ScrewChain& Inverse::chain() const {
  return takes_rotation() ? six_r()->chain() : rotary_pair()->chain();
}

InverseSolutions Inverse::solve(const Pose& tool, const JointVector& near) const {
  InverseSolutions out;
  if (const SixR* arm = six_r()) {
    const SixRSolutions solved = arm->solve(tool, near);
    out.q = solved.q;
    out.valid = solved.valid;
    out.count = 8;
    return out;
  }
  const RotaryPair& pair = *rotary_pair();
  const RotaryPairSolutions solved =
      pair.solve({tool.translation(), tool.linear() * pair.chain().tool_axis}, near);
  for (std::size_t b = 0; b < 2; ++b) {
    out.q[b] = solved.q[b];
    out.valid[b] = solved.valid[b];
  }
  out.count = 2;
  return out;
}

std::optional<JointVector> Inverse::nearest(const Pose& tool, const JointVector& near) const {
  InverseSolutions solved = solve(tool, near);
  const auto& joints = chain().joints;
  double best = INFINITY;
  std::optional<JointVector> found;
  for (int b = 0; b < solved.count; ++b) {
    if (!solved.valid[static_cast<std::size_t>(b)]) continue;
    JointVector& q = solved.q[static_cast<std::size_t>(b)];
    double step = 0.0;
    for (std::size_t j = 0; j < joints.size(); ++j) {
      if (joints[j].kind != JointKind::rotary) continue;
      const auto i = static_cast<Eigen::Index>(j);
      q[i] += 2.0 * kPi * std::round((near[i] - q[i]) / (2.0 * kPi));
      step = std::max(step, std::abs(q[i] - near[i]));
    }
    if (step >= best) continue;
    best = step;
    found = q;
  }
  return found;
}

}  // namespace smoothpost
