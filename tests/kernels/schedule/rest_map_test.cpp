#include "kernels/schedule/rest_map.h"

#include <catch2/catch.hpp>
#include <cmath>
#include <limits>

#include "kernels/core/contract.h"

namespace smoothpost {
namespace {

constexpr double kNone = std::numeric_limits<double>::infinity();

struct Case {
  double length;
  RestGrading grading;
  RestEnds ends;
};

const std::vector<Case>& cases() {
  static const std::vector<Case> all = {
      {400.0, {250.0, 8e3, 80e3}, {true, true}},  {400.0, {250.0, 8e3, 80e3}, {true, false}},
      {400.0, {250.0, 8e3, 80e3}, {false, true}}, {400.0, {250.0, 8e3, 80e3}, {false, false}},
      {0.05, {250.0, 8e3, 80e3}, {true, true}},   {0.05, {250.0, 1e3, 1e6}, {true, false}},
      {3.0, {kNone, 8e3, 80e3}, {true, true}},    {3.0, {250.0, kNone, kNone}, {true, true}},
      {3.0, {250.0, 1e3, kNone}, {false, true}},  {1e6, {10.0, 1e3, 1e7}, {true, true}}};
  return all;
}

std::array<double, 4> values(const RestMap& map, double w) { return map.at(w, map.zone(w)); }

}  // namespace

TEST_CASE("rest_map: golden values", "[kernels][schedule]") {
  // reference/schedule.json, phi_check; metres
  const RestMap map(0.4, {0.25, 8.0, 80.0}, {});
  CHECK(map.ramp() == Approx(0.19364916731037085).epsilon(1e-13));
  CHECK(map.extent() == Approx(1.7549193338482967).epsilon(1e-13));
  const std::array<double, 8> w = {0.0,
                                   0.01,
                                   0.1,
                                   0.19,
                                   0.19364916731037085,
                                   0.8774596669241483,
                                   1.6549193338482966,
                                   1.7549193338482967};
  const double golden[4][8] = {
      {0.0, 1.2655469627340905e-05, 0.007514696273409041, 0.028135089304693908,
       0.029047375096555625, 0.2, 0.39248530372659096, 0.4},
      {0.0, 0.0037299211842696947, 0.17792118426969478, 0.2499934029058365, 0.25, 0.25,
       0.17792118426969492, 0.0},
      {0.0, 0.7195096886142419, 1.8709688614241768, 0.0053975897412827534, 0.0, 0.0,
       -1.870968861424176, 0.0},
      {80.0, 64.11527105618168, -21.247289438183113, -2.929849932547957, 0.0, 0.0,
       -21.24728943818315, 80.0}};
  for (int i = 0; i < 8; ++i)
    for (int k = 0; k < 4; ++k)
      CHECK(std::abs(values(map, w[i])[k] - golden[k][i]) <=
            1e-12 * (1.0 + std::abs(golden[k][i])));
}

TEST_CASE("rest_map: from 0 to L and at rest where it says", "[kernels][schedule]") {
  for (const Case& c : cases()) {
    const RestMap map(c.length, c.grading, c.ends);
    const auto first = values(map, 0.0), last = values(map, map.extent());
    CHECK(first[0] == 0.0);
    CHECK(last[0] == Approx(c.length).epsilon(1e-13));
    for (const auto& [rest, at] : {std::pair{c.ends.start, first}, std::pair{c.ends.end, last}}) {
      CHECK((at[1] == 0.0) == rest);
      CHECK(at[2] == 0.0);
      // the jerk of the first instant at b = 1 is the one it was made for
      if (rest) CHECK(std::abs(at[3]) <= c.grading.jerk * (1.0 + 1e-9));
    }
    CHECK(map.speed() <= c.grading.speed * (1.0 + 1e-12));
  }
}

TEST_CASE("rest_map: derivatives equal central differences", "[kernels][schedule]") {
  for (const Case& c : cases()) {
    const RestMap map(c.length, c.grading, c.ends);
    const double h = 1e-6 * map.extent();
    for (int i = 1; i < 400; ++i) {
      const double w = map.extent() * (i + 0.37) / 401.0;
      const MapZone zone = map.zone(w);
      const auto at = map.at(w, zone), before = map.at(w - h, zone), after = map.at(w + h, zone);
      double scale = map.length();
      for (int k = 0; k < 3; ++k) {
        scale /= std::max(map.ramp(), 0.02 * map.extent());
        CHECK(std::abs((after[k] - before[k]) / (2.0 * h) - at[k + 1]) < 1e-5 * 20.0 * scale);
      }
    }
  }
}

TEST_CASE("rest_map: C3 but for the kinks of the third derivative", "[kernels][schedule]") {
  for (const Case& c : cases()) {
    const RestMap map(c.length, c.grading, c.ends);
    CHECK(map.kinks().size() <= static_cast<std::size_t>(c.ends.count()));
    for (double kink : map.kinks()) {
      const auto a = map.at(kink, map.zone(kink * (1.0 - 1e-9)));
      const auto b = map.at(kink, map.zone(kink * (1.0 + 1e-9)));
      const double speed = map.speed(), ramp = map.ramp();
      const double rounding = 1e-9 + 1e-14 * map.extent() / ramp;  // of the place of the kink
      CHECK(std::abs(a[0] - b[0]) < 1e-12 * map.length());
      CHECK(std::abs(a[1] - b[1]) < rounding * speed);
      CHECK(std::abs(a[2] - b[2]) < rounding * speed / ramp);
      CHECK(std::abs(a[3] - b[3]) < rounding * speed / (ramp * ramp));
    }
  }
}

TEST_CASE("rest_map: inverse", "[kernels][schedule]") {
  for (const Case& c : cases()) {
    const RestMap map(c.length, c.grading, c.ends);
    double before = -1.0;
    for (int i = 0; i <= 1000; ++i) {
      const double s = c.length * i / 1000.0;
      const double w = map.inverse(s);
      CHECK(w > before);
      before = w;
      CHECK(std::abs(values(map, w)[0] - s) < 1e-13 * c.length);
    }
    CHECK(map.inverse(0.0) == 0.0);
    CHECK(map.inverse(c.length) == Approx(map.extent()).epsilon(1e-14));
  }
}

TEST_CASE("rest_map: short stretches have no cruise", "[kernels][schedule]") {
  const RestMap map(0.05, {250.0, 8e3, 80e3}, {});
  CHECK(map.extent() == Approx(2.0 * map.ramp()).epsilon(1e-14));
  CHECK(1.2 * map.speed() * map.ramp() == Approx(0.05).epsilon(1e-12));
  CHECK(map.ramp() == Approx(std::sqrt(12.0 * map.speed() / 80e3)).epsilon(1e-12));
}

TEST_CASE("rest_map: preconditions", "[kernels][schedule]") {
  CHECK_THROWS_AS(RestMap(0.0, {1.0, 1.0, 1.0}, {}), ContractViolation);
  CHECK_THROWS_AS(RestMap(1.0, {0.0, 1.0, 1.0}, {}), ContractViolation);
  CHECK_THROWS_AS(RestMap(1.0, {1.0, -1.0, 1.0}, {}), ContractViolation);
  CHECK_THROWS_AS(RestMap(1.0, {kNone, kNone, kNone}, {}), ContractViolation);
  CHECK_THROWS_AS(RestMap(1.0, {kNone, 1.0, 1.0}, {false, false}), ContractViolation);
}

}  // namespace smoothpost
