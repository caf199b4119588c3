#include <catch2/catch.hpp>
#include <sstream>

#include "postproc/pipeline/registry.h"
#include "tests/support/machines.h"
#include "tests/support/support.h"

// CL data and the Heidenhain programs that an independent post made of it, both read by us, are the
// same motion.
namespace smoothpost::test {
namespace {

/// A motion as both files can tell it: its end to the third decimal that the post prints.
struct Step {
  Vec3 end = Vec3::Zero();
  bool rapid = false;
  bool arc = false;
  std::uint32_t line = 0;
};

InterpretedInput read_file(const std::filesystem::path& path, const char* format) {
  InputSettings settings;
  settings.file_name = path.filename().string();
  settings.machine = shipped_machine("table_table_bc");
  settings.machine->process.unmapped = UnmappedWords::comment;
  settings.cl.unit = 1.0;
  for (int tool = 1; tool < 1000; ++tool) settings.tool_lengths[tool] = 60.0;
  settings.subroutine_folders = {path.parent_path().string()};
  auto read = find_input_format(format)->read(read_bytes(path), settings);
  std::string all;
  for (const Diagnostic& d : read.diagnostics()) all += to_string(d) + "\n";
  INFO(path.string() << "\n" << all);
  REQUIRE(read.ok());
  return std::move(read.value());
}

/// The motions of a path with the tool along `axis`, in the frame whose axes `turn` names. Moves in
/// machine coordinates and, of the post's copy, moves that change no printed decimal are left out.
std::vector<Step> steps_of(const ToolPath& path, const Vec3& axis, const Mat3& turn) {
  std::vector<Step> steps;
  for (const PathPoint& p : path.points) {
    if ((p.location.axis - axis).norm() > 1e-6) continue;
    Step step{turn * p.location.tip, p.kind == MotionKind::rapid, p.is_arc, p.line};
    const bool moves =
        steps.empty() || step.arc || (step.end - steps.back().end).cwiseAbs().maxCoeff() >= 0.001;
    if (moves) steps.push_back(step);
  }
  return steps;
}

struct Difference {
  std::size_t compared = 0, arcs = 0, rapids = 0;
  double worst = 0.0, sum = 0.0;
  std::string first;
};

Difference difference(const std::vector<Step>& cl, const std::vector<Step>& posted) {
  Difference out;
  constexpr double kPrinted = 0.00051;
  for (std::size_t i = 0; i < std::min(cl.size(), posted.size()); ++i) {
    const double off = (cl[i].end - posted[i].end).cwiseAbs().maxCoeff();
    if (off > kPrinted || cl[i].arc != posted[i].arc || cl[i].rapid != posted[i].rapid) {
      std::ostringstream text;
      text << "step " << i << ": CL line " << cl[i].line << " (" << cl[i].end.transpose()
           << ") rapid " << cl[i].rapid << " arc " << cl[i].arc << ", posted line "
           << posted[i].line << " (" << posted[i].end.transpose() << ") rapid " << posted[i].rapid
           << " arc " << posted[i].arc;
      out.first = text.str();
      break;
    }
    ++out.compared;
    out.arcs += cl[i].arc ? 1 : 0;
    out.rapids += cl[i].rapid ? 1 : 0;
    out.worst = std::max(out.worst, off);
    out.sum += off;
  }
  if (out.first.empty() && cl.size() != posted.size())
    out.first = std::to_string(cl.size()) + " motions in the CL data, " +
                std::to_string(posted.size()) + " in the program";
  return out;
}

}  // namespace

TEST_CASE("corpus: boss.apt and the programs that a post made of it are the same motion",
          "[postproc][pipeline][corpus]") {
  const auto folder = shared_path("corpus/2_apt_cl/aamorim1913");
  if (!folder) {
    WARN("no corpus beside the checkout: skipped");
    return;
  }
  const InterpretedInput cl = read_file(*folder / "parts-tools/boss.apt", "cl");
  Mat3 second;  // x y z of the second setup are −Z Y X of the part
  second << 0, 0, -1, 0, 1, 0, 1, 0, 0;
  struct Setup {
    const char* file;
    Vec3 axis;
    Mat3 turn;
  };
  for (const Setup& setup :
       {Setup{"11.h", Vec3::UnitZ(), Mat3::Identity()}, Setup{"12.h", Vec3::UnitX(), second}}) {
    const InterpretedInput posted =
        read_file(*folder / "tests/parts-tools/boss" / setup.file, "nc");
    const Difference d = difference(steps_of(cl.path, setup.axis, setup.turn),
                                    steps_of(posted.path, Vec3::UnitZ(), Mat3::Identity()));
    INFO(setup.file << ": " << d.first);
    WARN(setup.file << ": " << d.compared << " motions, " << d.arcs << " arcs, " << d.rapids
                    << " rapids; ends differ by " << d.sum / static_cast<double>(d.compared)
                    << " mm on average, " << d.worst << " mm at most");
    CHECK(d.first.empty());
    CHECK(d.compared > 4000);
  }
}

}  // namespace smoothpost::test
