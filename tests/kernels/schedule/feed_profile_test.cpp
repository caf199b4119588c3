#include "kernels/schedule/feed_profile.h"

#include <catch2/catch.hpp>

#include "tests/kernels/schedule/feed_paths.h"

namespace smoothpost {

using test::from_rest_to_rest;

TEST_CASE("feed_profile: derivatives equal central differences", "[kernels][schedule]") {
  const FeedProfile profile = from_rest_to_rest(test::path6(), test::path6_limits()).profile;
  const double h = 1e-6;
  int checked = 0;
  for (int i = 1; i < 500; ++i) {
    const double t = profile.duration() * i / 500.0;
    const FeedState a = profile.at(t - h), at = profile.at(t), b = profile.at(t + h);
    CHECK(std::abs((b.s - a.s) / (2.0 * h) - at.first) < 1e-4);
    CHECK(std::abs((b.first - a.first) / (2.0 * h) - at.second) < 0.1);
    if (std::abs(b.third - a.third) < 1.0) {  // no kink of the law between
      CHECK(std::abs((b.second - a.second) / (2.0 * h) - at.third) < 10.0);
      ++checked;
    }
  }
  CHECK(checked > 300);
}

TEST_CASE("feed_profile: rest at both ends", "[kernels][schedule]") {
  const FeedProfile profile = from_rest_to_rest(test::path6(), test::path6_limits()).profile;
  for (double t : {0.0, profile.duration(), -1.0, profile.duration() + 1.0}) {
    const FeedState at = profile.at(t);
    CHECK(at.s == Approx(t > 0.0 ? 400.0 : 0.0).margin(1e-12));
    CHECK(std::abs(at.first) < 1e-6);
    CHECK(std::abs(at.second) < 1e-2);
  }
}

TEST_CASE("feed_profile: time and place are inverse", "[kernels][schedule]") {
  const FeedProfile profile = from_rest_to_rest(test::path6(), test::path6_limits()).profile;
  double before = -1.0;
  for (int i = 0; i <= 2000; ++i) {
    const double s = 400.0 * i / 2000.0;
    const double t = profile.time(s);
    CHECK(t > before);
    before = t;
    CHECK(std::abs(profile.at(t).s - s) < 1e-12 * 400.0);
  }
  CHECK(profile.time(400.0) == Approx(profile.duration()).epsilon(1e-13));
}

TEST_CASE("feed_profile: empty", "[kernels][schedule]") {
  const FeedProfile none;
  CHECK(none.duration() == 0.0);
  CHECK(none.at(1.0).s == 0.0);
  CHECK(none.time(1.0) == 0.0);
}

}  // namespace smoothpost
