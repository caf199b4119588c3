#include "examples/paper_b/collisions.h"

#include <catch2/catch.hpp>

#include "kernels/geometry/triangle_tree.h"
#include "tests/support/support.h"

using namespace smoothpost;
using namespace smoothpost::paper_b;

TEST_CASE("paper B collisions: the graph clears the strip of Case 2 where via and cone meet it",
          "[examples][paper][collision]") {
  if (!triangle_tree_available()) return;
  const Study study(read_case(test::source_path("examples/paper_b/case2.csv"), 2), false);
  const TriangleMesh strip = strip_of(study.path(), 30.0, 1.0);
  CHECK(strip.triangles.size() == 2 * (study.path().locations.size() - 1));
  const auto rows = collision_rows(study, 2);
  REQUIRE(rows.size() == 5);
  std::size_t others = 0;
  for (const CollisionRow& r : rows) {
    INFO(r.method << " " << r.locations << " " << r.motions << " " << r.least << " " << r.queries
                  << " " << r.peak);
    CHECK(r.queries > 0);
    CHECK(r.motions >= (r.locations > 0 ? 1U : 0U));
    CHECK((r.least < 0.0) == (r.locations > 0));
    if (r.method == "graph") {
      CHECK(r.locations == 0);
      CHECK(r.motions == 0);
    }
    if (r.method == "via" || r.method == "cone") {
      CHECK(r.locations > 0);
      ++others;
    }
  }
  CHECK(others == 2);
}
