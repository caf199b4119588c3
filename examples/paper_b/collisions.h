#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "examples/paper_b/study.h"
#include "kernels/core/mesh.h"

// What the head of the shipped laser meets on the ways of the methods, and what it costs to know.
namespace smoothpost::paper_b {

/// A strip of sheet under the cutter locations, `half` mm to both sides, `gap` mm below the tip.
TriangleMesh strip_of(const Case& given, double half, double gap);

/// One method's way past the strip.
struct CollisionRow {
  std::string method;
  std::size_t locations = 0;  ///< cutter locations at which the head is not free
  std::size_t motions = 0;    ///< straight joint motions between them that are not proven free
  double least = 0.0;         ///< mm beyond the clearances, as far as below 50
  std::size_t queries = 0;    ///< pairs that were searched: domains and the check of the way
  std::size_t skipped = 0;    ///< that bounds have answered
  double peak = 0.0;          ///< rad/s³, of both rotaries at the programmed feed
};

/// qi, qi_c2, graph, via and cone in Case 2 with L0 = 0 and, but for the graph, q6 = 0. The graph:
/// the cheapest way through the domains (9 × 9 × 5 cells, both branches) of every `every`-th cutter
/// location, as a spline.   @pre built with CGAL
std::vector<CollisionRow> collision_rows(const Study& study, std::size_t every = 1);

/// Prints them.
void print_collisions(const Study& study);

}  // namespace smoothpost::paper_b
