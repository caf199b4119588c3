#include "postproc/pipeline/reference_path.h"

#include "tests/postproc/pipeline/smoothed_checks.h"

using namespace smoothpost;
using namespace smoothpost::test;

TEST_CASE("reference_path: place_between shares the tip's length", "[postproc][pipeline][smooth]") {
  std::size_t count = 0;
  Random dice(9);
  for_random_paths(
      90, 2, [&](const Sample&, const std::vector<Cut>&, const ReferencePath& reference) {
        const auto total = static_cast<double>(reference.segments());
        const auto place_of = [](double x) {
          const double k = std::max(1.0, std::ceil(x));
          return PathPlace{static_cast<std::uint32_t>(k), x - (k - 1.0)};
        };
        // Tip length from the start of the path, by the shares of the segments.
        const auto length_at = [&](const PathPlace& p) {
          double sum = 0.0;
          for (std::size_t k = 1; k < p.segment; ++k) sum += reference.length(k);
          return sum + p.s * (p.segment == 0 ? 0.0 : reference.length(p.segment));
        };
        for (int n = 0; n < 20; ++n) {
          const double x = dice.between(0.0, total);
          const double y = dice.between(x, std::min(total, x + 6.0));
          const PathPlace from = place_of(x), to = place_of(y);
          const double a = length_at(from), b = length_at(to);
          // On a turn on the spot the tip's length says nothing.
          if (reference.length(from.segment) > 0.0)
            CHECK(number(place_between(reference, from, to, 0.0)) == Approx(x).margin(1e-9));
          if (reference.length(to.segment) > 0.0)
            CHECK(number(place_between(reference, from, to, 1.0)) == Approx(y).margin(1e-9));
          double last = x;
          for (int i = 1; i < 16; ++i) {
            const PathPlace p = place_between(reference, from, to, i / 16.0);
            CHECK(p.segment >= from.segment);
            CHECK(p.segment <= to.segment);
            CHECK(number(p) >= last - 1e-9);
            last = number(p);
            if (from.segment == to.segment)
              CHECK(number(p) == Approx(x + i / 16.0 * (y - x)).margin(1e-9));
            else if (b - a > 1e-6)
              CHECK(length_at(p) == Approx(a + i / 16.0 * (b - a)).margin(1e-6));
            ++count;
          }
        }
      });
  CHECK(count > 1000);
}
