#include <catch2/catch.hpp>

#include "postproc/jobs/job.h"
#include "tests/support/support.h"

using namespace smoothpost;

namespace {

struct Part {
  const char* what;
  const char* file;  ///< below corpus/5_stl
  const char* scale;
  const char* unit;
  ExitStatus status;
  const char* reason;  ///< of a refusal
};

// Certified, or refused by what stands in the way: the mill's length and ball, the walls, the room.
const Part kParts[] = {
    {"prism", "FreddieHong19/3D_Model/Prusa_i3/U_axis_2mm_spacer.stl", "", "",
     ExitStatus::certified, ""},
    {"ring with holes", "FreddieHong19/3D_Model/Prusa_i3/Slewing_ring_adaptor.stl", "", "",
     ExitStatus::certified, ""},
    {"saddle of a machine, at a tenth",
     "LinuxCNC/configs/sim/axis/vismach/VMC_toolchange/saddle.stl", "0.1", "",
     ExitStatus::certified, ""},
    {"mesh that another CAM fails at", "aewallin/stl/failedinpycam.stl", "", "",
     ExitStatus::certified, ""},
    {"inches, read as such", "mikedh/models/idler_riser.STL", "", "inch", ExitStatus::refused,
     "depth_of_cut"},
    {"inches read as millimetres", "mikedh/models/idler_riser.STL", "", "", ExitStatus::refused,
     "[RG132]"},
    {"cyclone of 2 mm", "openfoam-examples/cyclone.stl", "", "", ExitStatus::refused, "[RG132]"}};

}  // namespace

TEST_CASE("finish: parts of the corpus are certified or refused with a reason",
          "[postproc][jobs][finish][corpus]") {
  const auto folder = test::shared_path("corpus/5_stl");
  if (!folder) {
    WARN("no ../shared, not tested");
    return;
  }
  for (const Part& part : kParts) {
    Options o;
    o.command = "finish";
    o.machine = "finish_2p2r_1p1r";
    o.machine_path = test::source_path("machines").string();
    o.input = (*folder / part.file).string();
    o.output = "-";
    o.work_offset = {"auto"};
    o.mill = "1.5,60";
    o.unreachable = "leave-out";
    o.steepest = "60";
    o.contours = "outer";
    o.scale = part.scale;
    o.workpiece_unit = part.unit;
    const JobResult r = run_job(o, {});
    std::string told;
    for (const Diagnostic& d : r.diagnostics) told += to_string(d) + "\n";
    INFO(part.what << ": " << r.summary << "\n" << told.substr(0, 4000));
    CHECK(r.status == part.status);
    CHECK(told.find(part.reason) != std::string::npos);
    CHECK((r.status == ExitStatus::certified) == (r.verdict == "certified"));
  }
}
