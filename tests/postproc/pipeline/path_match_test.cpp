#include "postproc/pipeline/path_match.h"

#include <catch2/catch.hpp>

#include "kernels/core/units.h"
#include "postproc/pipeline/convert.h"
#include "postproc/pipeline/cuts.h"
#include "tests/support/machines.h"

using namespace smoothpost;
using namespace smoothpost::test;

namespace {

/// The path as a conversion sees it: everything that does not cut is a link.
ToolPath with_links(ToolPath path) {
  find_cuts(path, {});
  return path;
}

const std::string kProgram =
    "%\nM428\nG21 G90 G94\nG0 X0 Y0 Z20 A0 C0\nG0 Z1\nG1 X8 F600\nG1 X8 Y5\nG1 X0 Y5 A-20 C10\nG1 "
    "X-3 Y1 A-25 "
    "C0\nG0 Z20\nG53 G0 Z60\nG0 X5 Y5 Z10 A-10 C5\nG1 X9 F600\nG0 Z30\nM30\n%\n";

struct Fixture {
  ConvertInput in;
  Conversion conversion;
  ScrewChain chain;

  Fixture() {
    InputSettings settings;
    settings.machine = shipped_machine("table_table_ac");
    auto read = interpret_nc(kProgram, settings);
    REQUIRE(read.ok());
    in.input = std::move(read.value());
    in.machine = shipped_machine("table_table_bc");
    in.machine.recipe.smoothing = "none";  // a corner is one block's end
    conversion = convert(in, false, {});
    REQUIRE(conversion.verdict == Verdict::certified);
    chain = chain_of(in.machine);
  }

  PathMatch match(const ReadBack& read) const {
    const ToolPath cut_path = with_links(in.input.path);
    const ReferencePath reference(cut_path, in.input.frames);
    return match_paths(read, chain, reference,
                       {in.machine.tolerance.tip, in.machine.tolerance.axis}, {});
  }

  /// The first motion of the output that ends the given input line.
  std::size_t end_of_line(std::uint32_t line) const {
    for (std::size_t i = 0; i < conversion.line_map.size(); ++i)
      if (conversion.line_map[i].input_line == line && conversion.line_map[i].to_share == 1.0)
        return i;
    FAIL("no such line");
    return 0;
  }
};

}  // namespace

TEST_CASE("match_paths: a certified program matches its input without the map",
          "[postproc][pipeline]") {
  const Fixture f;
  const PathMatch match = f.match(f.conversion.read);
  INFO(match.reason << " at input " << match.input_line << ", output " << match.output_line);
  CHECK(match.matched);
  CHECK(match.share <= 1.0);
}

TEST_CASE("match_paths: dropped, doubled, exchanged and shifted blocks are found",
          "[postproc][pipeline]") {
  const Fixture f;
  const auto& moves = f.conversion.read.moves;
  const std::size_t corner = f.end_of_line(7);  // the corner at X8 Y5
  ReadBack dropped = f.conversion.read;
  // Line 7 ends at a corner of the path: without it the program cuts the corner.
  dropped.moves.erase(dropped.moves.begin() + static_cast<std::ptrdiff_t>(corner));
  CHECK_FALSE(f.match(dropped).matched);

  ReadBack doubled = f.conversion.read;  // there and back and there again
  const std::size_t leg = f.end_of_line(6);
  doubled.moves.insert(doubled.moves.begin() + static_cast<std::ptrdiff_t>(leg) + 1,
                       {moves[leg - 1], moves[leg]});
  doubled.moves[leg + 1].rapid = false;
  doubled.moves[leg + 1].duration = 0.1;
  CHECK_FALSE(f.match(doubled).matched);

  for (int joint = 0; joint < 5; ++joint) {
    ReadBack shifted = f.conversion.read;
    shifted.moves[corner].to[joint] += joint < 3 ? 0.02 : radians_from_degrees(0.1);
    INFO("joint " << joint);
    // C turns about the tool axis while the table is level: what it moves is the tip, 8 mm off the
    // centre.
    CHECK_FALSE(f.match(shifted).matched);
  }
}

TEST_CASE("match_paths: an additional cut, a missing end and a missing second cut are found",
          "[postproc][pipeline]") {
  const Fixture f;
  ReadBack extra = f.conversion.read;
  ReadBackMove cut = extra.moves.back();
  cut.rapid = false;
  cut.duration = 1.0;
  cut.to[0] += 10.0;
  extra.moves.push_back(cut);
  CHECK_FALSE(f.match(extra).matched);

  ReadBack cut_short = f.conversion.read;
  cut_short.moves.resize(f.end_of_line(13));
  const PathMatch match = f.match(cut_short);
  CHECK_FALSE(match.matched);
  CHECK(match.input_line >= 12);

  ReadBack first_only = f.conversion.read;
  first_only.moves.resize(f.end_of_line(9) + 1);
  CHECK_FALSE(f.match(first_only).matched);
}

TEST_CASE("match_paths: blocks may be split otherwise than the input's", "[postproc][pipeline]") {
  const Fixture f;
  ReadBack split;
  for (const auto& move : f.conversion.read.moves) {
    if (!split.moves.empty() && split.moves.back().known == 0x1f) {
      ReadBackMove half = move;
      half.to = 0.5 * (split.moves.back().to + move.to);
      split.moves.push_back(half);
    }
    split.moves.push_back(move);
  }
  CHECK(f.match(split).matched);
}
