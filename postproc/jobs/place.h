#pragma once

#include <functional>
#include <optional>
#include <string>

#include "kernels/core/result.h"
#include "postproc/jobs/settings.h"
#include "postproc/pipeline/convert.h"
#include "postproc/pipeline/place.h"
#include "postproc/report/report_json.h"

// `smoothpost place` and `--work-offset auto`: the options, the trial conversions, the words.
namespace smoothpost {

/// --box x0,y0,z0,x1,y1,z1 (mm) and --turn DEG.
struct PlaceOptions {
  std::optional<ReachBox> box;
  double turn = 3.14159265358979323846;  ///< rad
};
/// Failures: US160 (--box), US161 (--turn).
Result<PlaceOptions> read_place_options(const Options& options);

/// "G54" ... "G59.3" for 1 ... 9.
std::string system_name(int system);

/// "G54=x,y,z,a,b,c" as --work-offset reads it, mm and deg, no more digits than needed.
std::string work_offset_text(int system, const OffsetOption& offset);
/// "the program's zero lies at ... mm in the machine's workpiece frame", for a certificate.
std::string placement_sentence(const OffsetOption& offset);

/// The first of the places where the program is certified, with its conversion.
struct PlacedConversion {
  std::size_t place = 0;
  Conversion conversion;
};

/// Converts at one place after the other, best first, until a program is certified; `convert_at` is
/// given each place. Failures: KN141 (no place within reach and limits: says what is worst, and
/// where), KN142 (places, but no certified program at any: says why for each), or
/// the errors of a conversion that no place would change. A note KN143 says
/// which better places were passed over, and why.
Result<PlacedConversion> first_certified(
    const Places& places, int system,
    const std::function<Conversion(const FoundPlace&)>& convert_at);

/// What `smoothpost place` prints.
std::string place_text(const Places& places, std::size_t place, int system);
PlacementReport placement_report(const Places& places, std::optional<std::size_t> place,
                                 int system);

}  // namespace smoothpost
