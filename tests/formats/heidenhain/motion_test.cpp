#include <catch2/catch.hpp>
#include <random>

#include "formats/heidenhain/corner.h"
#include "tests/formats/heidenhain/recording.h"

namespace smoothpost::test {

using Places = std::vector<std::string>;

TEST_CASE("lines: modal words and signs and commas and increments", "[formats][heidenhain]") {
  const auto r = read_blocks("3 L X+1,5 Y-2.25\n4 L IX+2 IZ-10\nL Z 5 F 300\n/ L X-1");
  INFO(r.all_text());
  REQUIRE(r.ok);
  CHECK(r.places() ==
        Places{"r 0 0 10", "f 1.5 -2.25 10", "f 3.5 -2.25 0", "f 3.5 -2.25 5", "f -1 -2.25 5"});
  CHECK(r.sink.motions[1].duration == Approx(std::hypot(1.5, 2.25) / 10.0));
  CHECK(r.sink.motions[3].duration == Approx(1.0));
  CHECK(r.sink.motions[0].unknown_start == 0x1ff);
  CHECK((r.sink.motions[1].unknown_start & 7) == 0);
  CHECK(r.summary.ended);
}

TEST_CASE("lines: a program in inch has its feed in tenths of an inch", "[formats][heidenhain]") {
  const auto r =
      read_program("0 BEGIN PGM T INCH\n1 L X+0 Y+0 Z+0 FMAX\n2 L X+1 F600\n3 END PGM T INCH\n");
  INFO(r.all_text());
  REQUIRE(r.ok);
  CHECK(r.sink.motions[1].end[0] == Approx(25.4));
  CHECK(r.sink.motions[1].duration == Approx(1.0));  // 60 inch/min
}

TEST_CASE("lines: a position of the machine loses the place in the program",
          "[formats][heidenhain]") {
  const auto r = read_blocks("3 L Z-10 FMAX M91\n4 L X+5 FMAX\n5 L Z+3 FMAX");
  REQUIRE(r.ok);
  REQUIRE(r.sink.motions.size() == 4);
  CHECK(r.sink.motions[1].machine_position);
  CHECK(r.sink.motions[1].end[2] == -10.0);
  CHECK((r.sink.motions[2].unknown_end & 7) == 4);
  CHECK((r.sink.motions[3].unknown_end & 7) == 0);
}

TEST_CASE("arcs: the forms of a quarter are one quarter", "[formats][heidenhain]") {
  // From (10, 0) about (0, 0) to (0, 10), the other way round for DR-.
  for (const char* form :
       {"L X+10\nCC X+0 Y+0\nC X+0 Y+10 DR+", "L X+10\nCR X+0 Y+10 R+10 DR+",
        "L X+10\nCC IX-10 IY+0\nCP IPA+90 DR+", "L X+10\nCC X+0 Y+0\nCP PA+90 DR+",
        "L X+10 Y-1\nL X+10 Y+0\nCT X+0 Y+10"}) {
    const auto r = read_blocks(form);
    INFO(form << "\n" << r.all_text());
    REQUIRE(r.ok);
    const CanonicalMotion& m = r.sink.motions.back();
    REQUIRE(m.is_arc);
    CHECK((m.arc.centre - Vec3(0, 0, 10)).norm() < 1e-9);
    CHECK(m.arc.sweep == Approx(kPi / 2));
    CHECK((end_of(m) - Vec3(0, 10, 10)).norm() < 1e-9);
    CHECK(m.duration == Approx(5.0 * kPi / 10.0));
  }
  const auto other = read_blocks("L X+10\nCC X+0 Y+0\nC X+0 Y+10 DR-");
  CHECK(other.sink.motions.back().arc.sweep == Approx(-1.5 * kPi));
  const auto large = read_blocks("L X+10\nCR X+0 Y+10 R-10 DR-");
  CHECK(large.sink.motions.back().arc.sweep == Approx(-1.5 * kPi));
  CHECK(read_blocks("L X+10\nCC X+0 Y+0\nC DR-").sink.motions.back().arc.sweep == Approx(-2 * kPi));
  const auto helix = read_blocks("L X+10\nCC X+0 Y+0\nCP IPA-720 IZ-4 DR-");
  REQUIRE(helix.ok);
  CHECK(helix.sink.motions.back().arc.sweep == Approx(-4 * kPi));
  CHECK((end_of(helix.sink.motions.back()) - Vec3(10, 0, 6)).norm() < 1e-9);
  CHECK(read_blocks("CC X+0 Y+0\nL X+10\nLP PR+20 PA+30").places().back() == "f 17.3205 10 10");
}

TEST_CASE("arcs: what is no arc is told", "[formats][heidenhain]") {
  using Codes = std::vector<std::string>;
  for (const char* blocks :
       {"C X+1 Y+1 DR+", "CC X+5 Y+0\nC X+9 Y+9 DR+", "CC X+0 Y+0\nC X+1 Y+1 DR-", "CR X+9 R+1 DR+",
        "CR X+9 DR+", "CC X+5 Y+0\nC X+0 Y+0", "CC X+5\nC DR+", "CC X+5 Y+0\nCP IPA+90 DR-",
        "L X+5\nCT X+9", "CC X+5 Y+0\nC DR+ FMAX", "L Z+1 FMAX M91\nL IX+1 FMAX M91"}) {
    const auto r = read_blocks(blocks);
    INFO(blocks << "\n" << r.all_text());
    REQUIRE_FALSE(r.ok);
    const bool last = std::string(blocks).find("M91") != std::string::npos;
    CHECK(r.errors() == Codes{last ? "NC404" : "NC410"});
  }
}

TEST_CASE("corners: RND touches both lines", "[formats][heidenhain]") {
  std::mt19937 random(4);
  std::uniform_real_distribution<double> place(-50.0, 50.0);
  int rounded = 0;
  for (int i = 0; i < 400; ++i) {
    const conversational::CornerLines lines{{place(random), place(random), 3.0},
                                            {place(random), place(random), 3.0},
                                            {place(random), place(random), 3.0}};
    const double radius = 0.5 + 0.02 * i;
    const auto corner = conversational::rounded_corner(lines, radius);
    if (!corner.problem.empty()) continue;
    ++rounded;
    const Vec3 first = (lines.corner - lines.start).normalized();
    const Vec3 second = (lines.end - lines.corner).normalized();
    for (const auto& [point, from, along] : {std::tuple(corner.begin, lines.start, first),
                                             std::tuple(corner.end, lines.corner, second)}) {
      CHECK((point - from).cross(along).norm() < 1e-9);
      CHECK((point - corner.centre).norm() == Approx(radius));
      CHECK((point - corner.centre).dot(along) == Approx(0.0).margin(1e-9));
    }
    const Vec3 turned = corner.centre + rotation_about(Vec3::UnitZ(), corner.sweep) *
                                            (corner.begin - corner.centre);
    CHECK((turned - corner.end).norm() < 1e-9);
    CHECK(std::abs(corner.sweep) < kPi);
  }
  CHECK(rounded > 150);
}

TEST_CASE("corners: RND and CHF between lines", "[formats][heidenhain]") {
  const auto r = read_blocks("L X+10\nRND R2 F300\nL Y+10\nCHF 1\nL X+0");
  INFO(r.all_text());
  REQUIRE(r.ok);
  CHECK(r.places() ==
        Places{"r 0 0 10", "f 8 0 10", "a 10 2 10", "f 10 9 10", "f 9 10 10", "f 0 10 10"});
  CHECK(r.sink.motions[2].duration == Approx(kPi / 5.0));
  CHECK(r.sink.motions[1].duration == Approx(0.8));
  CHECK(r.sink.motions[3].duration == Approx(0.7));
  for (std::size_t i = 1; i < r.sink.motions.size(); ++i)
    CHECK((start_of(r.sink.motions[i]) - end_of(r.sink.motions[i - 1])).norm() == 0.0);
  using Codes = std::vector<std::string>;
  for (const char* blocks : {"RND R2\nL X+10", "L X+10\nRND R20\nL Y+10", "L X+10\nRND R2\nL X+20",
                             "L X+10\nRND R2", "L X+10\nRND R2\nCC X+10 Y+5\nC X+10 Y+10 DR+",
                             "L X+10\nCHF 2\nL Z+0", "L X+10 FMAX\nRND R1\nL Y+5",
                             "L X+10\nRND R1\nRND R2\nL Y+5", "L X+10\nRND R1\nL Y+5 M8"}) {
    const auto bad = read_blocks(blocks);
    INFO(blocks << "\n" << bad.all_text());
    CHECK(bad.errors() == Codes{"NC411"});
  }
}

}  // namespace smoothpost::test
