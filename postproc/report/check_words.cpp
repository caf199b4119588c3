#include "postproc/report/check_words.h"

#include <array>
#include <utility>

namespace smoothpost {

namespace {

using Row = std::pair<std::string_view, std::string_view>;

constexpr std::array kChecks = {
    Row{"tip_deviation", "how far the tool tip leaves the input's path, proven everywhere"},
    Row{"axis_deviation", "how far the tool axis turns away from the input's"},
    Row{"rotation_deviation", "how far the whole tool frame turns away from the input's"},
    Row{"lead_deviation", "how far the beam leans along the cut from the programmed lead"},
    Row{"tilt_deviation", "how far the beam leans across the cut from the programmed tilt"},
    Row{"exit_edge_deviation", "how far the cut's edge is shifted on the far side of the sheet"},
    Row{"tilted_gap", "what is left of the gap under the nozzle's rim; at least the limit"},
    Row{"standoff_deviation", "the part of the tip's deviation along the tool axis"},
    Row{"path_complete", "every stretch of the input appears once, in order"},
    Row{"part_registration", "the input lies on the part's surface at the nominal gap"},
    Row{"depth_of_cut", "how far the depth in the stock is from the one asked for"},
    Row{"mill_room", "how far the end mill is in the part"},
    Row{"stream_rows", "rows of the joint stream too many or missing"},
    Row{"stream_cycle", "how far a row's printed time is from its cycle"},
    Row{"contour_deviation", "how far smoothing has moved the path from the part's surface"},
    Row{"axis_to_normal", "how far the tool axis leans from the surface's normal"},
    Row{"gap", "the program keeps the nominal gap to the part's surface"},
    Row{"position_limit", "largest share of the axis' range that is used, 1 at a limit"},
    Row{"velocity_limit", "largest speed of the axis in the printed block times"},
    Row{"acceleration_limit", "largest acceleration of the axis in the feed schedule"},
    Row{"jerk_limit", "largest jerk of the axis in the feed schedule"},
    Row{"min_cut_speed", "slowest place with the beam on; at least the limit"},
    Row{"power_follows_speed", "how far the commanded power is from that of the tip's speed"},
    Row{"clearance", "distance of the tightest pair of bodies; at least the limit"},
    Row{"round_trip", "the printed digits, read back, are what was planned"},
    Row{"beam_as_programmed", "blocks whose beam is not as the input has it"},
    Row{"link_clearance", "height of low links over the part's box; at least the limit"},
    Row{"tip_held", "how far the tip leaves its point while an axis swings"},
    Row{"process_as_programmed",
        "cuts that start with another spindle, coolant, gas or power state"},
    Row{"process_complete",
        "states left on at the end, and stretches with the beam on too many or missing"},
    Row{"link_depth", "how deep the tool goes between two cuts, below both of their ends"},
    Row{"event_position", "how far along the path the beam may change off its place"},
    Row{"beam_off_in_rapid", "rapids with the beam on"},
    Row{"beam_off_in_link", "motions between cuts with the beam on"},
    Row{"beam_off_at_start_and_end", "the beam is off before the first and after the last motion"},
    Row{"beam_dwell", "time that the beam burns on one spot, other than piercing"},
    Row{"offset_guard", "the program stops itself when other offsets are live"},
    Row{"exact_path", "the control is told not to blend without a bound"},
};

constexpr std::array kUnchecked = {
    Row{"clearance",
        "Nothing was checked against collision: head, tool, table and part. Run it in a simulator "
        "or with the rapid override down."},
    Row{"part_clearance",
        "The part was not given (-w): the machine's bodies were checked among themselves, not "
        "against it."},
    Row{"acceleration_limit", "The control's own acceleration: nothing is promised of it."},
    Row{"jerk_limit", "The control's own jerk: nothing is promised of it."},
    Row{"part_registration",
        "The part was not given (-w): that the program lies on it was not compared."},
    Row{"gap", "The part was not given (-w): the gap of the nozzle to it was not measured."},
    Row{"tip_deviation",
        "The program was compared with no input (--against): its shape is not certified."},
    Row{"axis_deviation",
        "The program was compared with no input (--against): its tool axes are not certified."},
    Row{"process_as_programmed",
        "The program was compared with no input (--against): when spindle, coolant, gas and beam "
        "are on is not certified."},
    Row{"feed",
        "The program's feeds were held against the axes' velocities, not against the input's "
        "feeds."},
    Row{"process_values",
        "Values of events, such as spindle speed and tool number, and waits and stops were not "
        "compared with the input's."},
    Row{"link_path",
        "The ways between cuts were not compared with the input's: of them the axes' ranges, the "
        "beam and their depth were checked."},
};

template <typename Table>
std::string find(const Table& table, std::string_view name) {
  const std::string_view stem = name.substr(0, name.find('.'));
  for (const auto& [key, words] : table)
    if (key == stem) return std::string(words);
  return {};
}

}  // namespace

std::string check_words(std::string_view name) { return find(kChecks, name); }

std::string unchecked_words(std::string_view name) { return find(kUnchecked, name); }

}  // namespace smoothpost
