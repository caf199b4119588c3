#include <cstdio>
#include <iostream>

#include "examples/paper_a/paper_literal.h"
#include "kernels/core/units.h"
#include "kernels/smooth/blend_function.h"

// Prints Tables 2 and 3 of [Cai2025]: as its authors computed them (with the wrong sign of m2), as
// its equations are printed, and the fit that does not depend on the frame (acr_fit).
namespace smoothpost::paper_a {
namespace {

std::string row(const LiteralCorner& corner, std::size_t number) {
  const LiteralFit theirs = literal_fit(corner, SignOfM2::of_the_tables);
  const LiteralFit printed = literal_fit(corner, SignOfM2::printed);
  const AcrShape ours = acr_fit(angle_between(corner.incoming, corner.outgoing));
  std::array<char, 256> text{};
  std::snprintf(text.data(), text.size(),
                "%zu %12.7g | %8.5f %12.4e %11.4e | %8.5f %8.5f %11.4e | %8.5f %8.5f\n", number,
                corner.length, theirs.shape.kappa, theirs.shape.lambda, theirs.error,
                printed.shape.kappa, printed.shape.lambda, printed.error, ours.kappa, ours.lambda);
  return text.data();
}

void table(const char* name, double tip, double angle) {
  std::cout << name << "\n"
            << "             L | authors: kappa, lambda, e         | equations: kappa, lambda, e"
               "     | frame-free: kappa, lambda\n";
  std::cout << "tip, mm\n";
  for (std::size_t i = 1; i <= 3; ++i) std::cout << row(tip_corner(i, tip), i);
  std::cout << "orientation, rad\n";
  for (std::size_t i = 1; i <= 3; ++i) std::cout << row(angle_corner(i, angle), i);
}

}  // namespace
}  // namespace smoothpost::paper_a

int main() {
  smoothpost::paper_a::table("Table 2: 0.8 mm, 0.01 rad", 0.8, 0.01);
  smoothpost::paper_a::table("Table 3: 1.2 mm, 0.005 rad", 1.2, 0.005);
  return 0;
}
