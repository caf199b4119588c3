#pragma once

#include <cstddef>
#include <string_view>

namespace smoothpost::cl {

/// How many CIRCLE statements of the NX form (eight values and more) of a text go with the straight
/// motions before and after them in the right-hand sense about their axis, and how many in the
/// other.
struct TangentVotes {
  std::size_t right_hand = 0;
  std::size_t left_hand = 0;
};

/// A straight motion votes when it meets the circle's tangent within 2°, in either direction.
/// Cost: linear, one pass; statements that cannot be read vote for nothing.
TangentVotes count_tangents(std::string_view text);

/// Values that a CIRCLE of the NX form has at least: x,y,z,i,j,k,r and a tolerance.
inline constexpr std::size_t kNxCircleValues = 8;

}  // namespace smoothpost::cl
