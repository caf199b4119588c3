#pragma once

#include <array>
#include <optional>
#include <string>
#include <vector>

#include "formats/heidenhain/variables.h"
#include "kernels/core/canonical_motion.h"

namespace smoothpost::conversational {

/// The words of one motion block or of a block of M functions.
struct MotionWords {
  AxisWords value{};  ///< as written: mm or inch, degrees
  AxisMask absolute = 0;
  AxisMask incremental = 0;
  std::array<std::size_t, kAxisWords> at{};  ///< where each word stands

  Vec3 tool = Vec3::Zero();  ///< TX TY TZ
  unsigned tool_words = 0;   ///< bit 0: TX ...
  bool normal = false;       ///< NX NY or NZ

  std::optional<double> radius;  ///< R of CR
  std::optional<double> polar_radius, polar_angle;
  bool radius_incremental = false, angle_incremental = false;
  std::optional<bool> clockwise;  ///< DR- or DR+

  std::optional<double> feed;
  bool rapid = false;           ///< FMAX
  std::optional<double> speed;  ///< S
  std::vector<int> m;
  std::vector<std::size_t> m_at;

  AxisMask axes() const { return static_cast<AxisMask>(absolute | incremental); }
  bool has(int m_word) const;
};

/// Why the words could not be read, and where.
struct WordFault {
  const char* code = "";
  std::string text;
  std::size_t offset = 0;
};

/// Reads words up to the end of the block: axes with I, TX .. NZ, PR PA, R of CR, DR, F, FMAX, S,
/// M, R0. RL and RR, F AUTO by tooth or turn and words of other blocks are faults.
/// @param arc_radius  R is the radius of CR
std::optional<WordFault> read_motion_words(Scanner& scanner, const Variables& variables,
                                           bool arc_radius, MotionWords& out);

}  // namespace smoothpost::conversational
