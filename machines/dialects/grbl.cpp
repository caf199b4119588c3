#include "machines/dialects/grbl.h"

#include <algorithm>
#include <cmath>

#include "kernels/core/contract.h"
#include "kernels/core/units.h"
#include "machines/dialects/decimal.h"
#include "machines/dialects/gcode_program.h"
#include "machines/dialects/grbl_firmware.h"

namespace smoothpost::grbl {

namespace {

constexpr std::size_t kMaxComment = 120;
constexpr double kFirstFeed = 600.0;  // mm or deg per min, where the start is not known
constexpr double kMillisecondsPerSecond = 1e3;

constexpr std::string_view kNineAxes = "XYZABCUVW";
constexpr std::string_view kSixAxes = "XYZABC";

constexpr std::array<Firmware, 5> kFirmwares = {{
    {"grbl", FeedRule::inverse_time, kNineAxes, true, true, true, false, false, false, true, "M0"},
    {"grbl_fluidnc", FeedRule::inverse_time, kSixAxes, true, true, true, false, false, false, true,
     "M0"},
    {"grbl_klipper", FeedRule::xyz_or_most, kNineAxes, false, false, false, true, true, false,
     false, "PAUSE"},
    {"grbl_marlin", FeedRule::linear_first, kNineAxes, false, false, false, true, true, true, false,
     "M0"},
    {"grbl_reprapfirmware", FeedRule::inverse_time, kNineAxes, true, false, false, true, false,
     false, false, "M226"},
}};

class Emitter : public gcode::GcodePrinter {
 public:
  Emitter(const MachineDefinition& machine, const MachineProgram& program, const Firmware& firmware)
      : GcodePrinter(machine, program, {}, {1, 9999999}), firmware_(firmware) {}

 private:
  void check() override {
    const DialectSettings& d = machine().dialect;
    if (has_poses())
      refuse("PR203",
             "dialect " + d.name + " has joint words only: write dialect.mode = \"joint\"");
    if (d.path_mode != "exact")
      refuse("PR203", "dialect " + d.name + " has no path_mode \"" + d.path_mode +
                          "\": write path_mode = \"exact\"");
    if (d.units != "mm")
      refuse("PR203", "dialect " + d.name +
                          " is written in mm: these firmwares do not agree on what G20 does to "
                          "rotary axes; write dialect.units = \"mm\"");
    if (d.offset_guard && !firmware_.machine_words)
      refuse("PR203", "dialect " + d.name +
                          " can neither read offsets nor leave them out: home, clear every offset "
                          "yourself and write dialect.offset_guard = false");
    for (const auto& axis : machine().axes)
      if (firmware_.letters.find(axis.letter) == std::string_view::npos)
        refuse("PR203", "axis " + axis.name + " has the letter " + std::string(1, axis.letter) +
                            ": this firmware has the axes " + std::string(firmware_.letters));
  }

  // ---- lines

  void words_line(std::initializer_list<const char*> words) {
    std::string joined;
    for (const char* word : words) {
      if (!firmware_.several_words) line(word);
      joined += (joined.empty() ? "" : " ") + std::string(word);
    }
    if (firmware_.several_words) block(joined);
  }

  void put(const std::string& text) { firmware_.several_words ? block(text) : line(text); }

  void head() override {
    if (!program().certified)
      comment("NOT CERTIFIED. Written with --force: read the report before you run it");
    for (const auto& title : program().title) comment(title);
    for (const auto& own : machine().dialect.start) own_line(own);
    modal_words();
    if (!program().certified) put(std::string(firmware_.stop));
  }

  void modal_words() {
    if (firmware_.several_words)
      words_line({"G21", "G17", "G90", "G94", "G40", "G49", "G80", "G54", "G61"});
    else if (firmware_.feed == FeedRule::inverse_time)
      words_line({"G21", "G90", "G94"});
    else
      words_line({"G21", "G90"});
    inverse_time_ = false;
    words().forget();
  }

  void foot() override {
    if (inverse_time_) put("G94");
    if (!firmware_.ends_with_m30) line("M400");
    bool ended = false;
    for (const auto& own : machine().dialect.end) {
      own_line(own);
      const std::string packed = packed_statement(own);
      ended = ended || packed == "M30" || packed == "M2";
    }
    if (!ended && firmware_.ends_with_m30) put("M30");
  }

  void own_line(const std::string& text) {
    firmware_.several_words ? GcodePrinter::own_line(text) : line(text);
  }

  void comment(const std::string& text) override {
    if (firmware_.round_comments) return GcodePrinter::comment(text);
    line("; " + plain_text(text, kMaxComment));
  }

  void label(const std::string& text) override {
    comment(text);
    modal_words();
  }

  void dwell(double seconds) override {
    put("G4 P" + (firmware_.dwell_milliseconds
                      ? decimal_text(std::ceil(seconds * kMillisecondsPerSecond), 0)
                      : decimal_text(seconds, 4)));
  }

  void statement(const std::string& text, const MachineAction& action) override {
    const bool stops = std::any_of(
        machine().process.events.begin(), machine().process.events.end(),
        [&](const EventWords& e) { return e.event == action.event.name && !e.on_the_fly; });
    if (firmware_.waits_for_events || (stops && !firmware_.several_words)) line("M400");
    put(text);
  }

  // ---- moves

  void print_move(std::size_t i) override {
    const MachineMove& m = move(i);
    const bool timed = firmware_.feed == FeedRule::inverse_time;
    if (timed && inverse_time_ == m.rapid) {
      put(m.rapid ? "G94" : "G93");
      inverse_time_ = !m.rapid;
    }
    std::string text = firmware_.machine_words ? "G53 " : "";
    text += m.rapid ? "G0" : "G1";
    text += words().joints(m.joints, m.to);
    if (timed && !m.rapid) text += inverse_time(m.duration);
    if (!timed) text += feed(m);
    put(text);
    if (last_.size() == 0) last_ = m.to;
    for (int j = 0; j < machine().size(); ++j)
      if (m.joints >> j & 1U) last_[j] = m.to[j];
    known_ |= m.joints;
  }

  // Rapids at the velocity limits: these firmwares have no rapid of their own.
  std::string feed(const MachineMove& m) const {
    if ((m.joints & ~known_) != 0) return " F" + decimal_text(kFirstFeed, 0);
    double seconds = m.duration;
    for (int j = 0; m.rapid && j < machine().size(); ++j)
      if (m.joints >> j & 1U)
        seconds = std::max(seconds, std::abs(m.to[j] - last_[j]) /
                                        machine().axes[static_cast<std::size_t>(j)].velocity);
    const double way = way_to(m);
    constexpr double kLeast = 1e-4;
    const double f = way > 0.0 && seconds > 0.0 ? way / seconds * kSecondsPerMinute : kFirstFeed;
    return " F" + decimal_text(std::max(f, kLeast), decimals_for(f, 7, 0, 4));
  }

  // What F is over, from the printed digits: mm or deg.
  double way_to(const MachineMove& m) const {
    std::array<double, 3> square{};  // X Y Z, U V W, A B C
    double most = 0.0;
    for (int j = 0; j < machine().size(); ++j) {
      if (!(m.joints >> j & 1U)) continue;
      const double way = printed(j, m.to[j]) - printed(j, last_[j]);
      const char letter = machine().axes[static_cast<std::size_t>(j)].letter;
      const std::size_t group = letter >= 'X' ? 0 : letter >= 'U' ? 1 : 2;
      square[group] += way * way;
      if (group > 0) most = std::max(most, std::abs(way));
    }
    if (square[0] > 0.0) return std::sqrt(square[0]);
    if (firmware_.feed == FeedRule::xyz_or_most) return most;
    return std::sqrt(square[1] > 0.0 ? square[1] : square[2]);
  }

  double printed(int j, double value) const {
    const bool rotary = machine().axes[static_cast<std::size_t>(j)].joint.kind == JointKind::rotary;
    return rotary ? rounded_decimal(degrees_from_radians(value), machine().dialect.digits_angle)
                  : rounded_decimal(value, machine().dialect.digits_length);
  }

  const Firmware& firmware_;
  bool inverse_time_ = false;
  JointVector last_;
  JointMask known_ = 0;  // joints that have a position in last_
};

}  // namespace

const Firmware* firmware_of(std::string_view dialect) {
  for (const auto& firmware : kFirmwares)
    if (firmware.dialect == dialect) return &firmware;
  return nullptr;
}

Result<EmittedProgram> emit(const MachineDefinition& machine, const MachineProgram& program) {
  const Firmware* firmware = firmware_of(machine.dialect.name);
  require(firmware != nullptr, "a dialect of the grbl family");
  return Emitter(machine, program, *firmware).run();
}

namespace {
constexpr const char* kInterpolation =
    "all joints linear from block to block; the firmware slows down at corners and never leaves "
    "the lines";
constexpr const char* kMachineWords =
    "every motion is in machine coordinates (G53), whatever offsets are live";
constexpr const char* kNoGuard =
    "no offset is live: the firmware can neither be asked nor told for one block";

constexpr Dialect row(const char* name, const char* description, const char* guard) {
  return {name, description, kInterpolation, ToolTurn::none, true, &emit, &read_back, guard};
}
}  // namespace

const std::array<Dialect, 5> kDialects = {
    row("grbl", "grblHAL, joint words in machine coordinates, G93", kMachineWords),
    row("grbl_fluidnc", "FluidNC, joint words in machine coordinates, G93", kMachineWords),
    row("grbl_klipper", "Klipper, joint words, F over X Y Z or the axis that moves most", kNoGuard),
    row("grbl_marlin", "Marlin, joint words, F over the linear axes or over the rotary ones",
        kNoGuard),
    row("grbl_reprapfirmware", "RepRapFirmware 3.5, joint words in machine coordinates, G93",
        kMachineWords)};

}  // namespace smoothpost::grbl
