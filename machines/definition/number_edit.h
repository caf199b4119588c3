#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "kernels/core/pose.h"
#include "kernels/core/result.h"

namespace smoothpost {

/// Three numbers of a machine file that get other values.
struct VectorChange {
  std::string axis;  ///< name of the [[axis]]; empty: [tool]
  std::string key;   ///< origin_mm, direction, tip_mm
  Vec3 value = Vec3::Zero();
  int decimals = 6;
};

/// The text of a machine file with other numbers in it and everything else, comments too, as it is.
/// A number that is the same to its decimals keeps its digits. MF101, MF102 as parse_toml(); MF105:
/// the file has no such list of three numbers.   Cost: linear.
Result<std::string> with_vectors(std::string_view text, const std::string& file,
                                 const std::vector<VectorChange>& changes);

}  // namespace smoothpost
