#pragma once

#include "kernels/core/check.h"
#include "kernels/kinematics/screw_chain.h"
#include "machines/definition/machine.h"
#include "machines/dialects/dialect.h"

// The links of a program without a line map.
namespace smoothpost {

struct LinkDepthInput {
  const MachineDefinition& machine;
  const ScrewChain& chain;   ///< tool length 0, part placed
  double tool_length = 0.0;  ///< mm, of the longest tool
  bool beam = false;         ///< feeds with the beam off are links too
};

/// Check link_depth: on its way between two cuts the tip is nowhere deeper than at both of its
/// ends, but for `tolerance.tip`, unless the retract axis (of an arm: the tip) is over the retract
/// plane. Depth is measured against the tool axis, as it is on the way or as at that end, whichever
/// says less; before the first and behind the last cut there is one end. So a rapid that dives, by
/// a lost sign or a wrong digit, is found; one that crosses the part as high as its ends is not.
/// `read`: joints of every move. Sampled every 2 mm or 2 deg at least.   Cost: linear in the links'
/// length.
Check link_depth_check(const ReadBack& read, const LinkDepthInput& input);

}  // namespace smoothpost
