#include <cmath>
#include <set>

#include "kernels/core/contract.h"
#include "kernels/core/units.h"
#include "machines/dialects/gcode_program.h"
#include "machines/dialects/grbl.h"
#include "machines/dialects/grbl_firmware.h"

namespace smoothpost::grbl {

namespace {

using gcode::Block;
using gcode::Word;

class Reading : public gcode::GcodeReading {
 public:
  Reading(const MachineDefinition& machine, const std::string& file, const Firmware& firmware)
      : GcodeReading(machine, file), firmware_(firmware) {}

 private:
  void finish() override {
    result.exact_path = true;  // there is no other mode
    result.offset_guard = machine_words_only_;
  }

  // The operator's stop may be an event of the machine, too.
  bool read_statement(const Block& block) override {
    if (block.text != firmware_.stop) return false;
    read_event(block.at, block.text);
    return true;
  }

  bool read_setting(const Block& block) override {
    if (block.has('G', 4.0)) {
      dwell(block, block.find('P'), firmware_.dwell_milliseconds ? 1e-3 : 1.0);
      return true;
    }
    if ((block.has('M', 30.0) || block.has('M', 2.0)) && !firmware_.ends_with_m30) {
      error(block.at, "M30 deletes the program on this firmware, or is unknown to it");
      return true;
    }
    if (read_statement(block)) return true;
    if (block.words.size() == 1 && block.has('M', 400.0)) return true;
    static const std::set<double> kCommon = {21, 90};
    static const std::set<double> kTimed = {93, 94};
    static const std::set<double> kGrbl = {17, 40, 49, 54, 61, 80};
    for (const auto& word : block.words) {
      const bool known =
          kCommon.count(word.value) > 0 ||
          (firmware_.feed == FeedRule::inverse_time && kTimed.count(word.value) > 0) ||
          (firmware_.several_words && kGrbl.count(word.value) > 0);
      if (word.letter != 'G' || !known) return false;
    }
    if (block.words.size() > 1 && !firmware_.several_words) {
      error(block.at, "this firmware takes one code in a block");
      return true;
    }
    for (const auto& word : block.words) {
      if (word.value == 21.0) unit_ = true;
      if (word.value == 90.0) absolute_ = true;
      if (kTimed.count(word.value) > 0) inverse_time_ = word.value == 93.0;
    }
    return true;
  }

  void read_motion(const Block& block) override {
    if (!unit_ || !absolute_) return error(block.at, "a motion stands before G21 and G90");
    int codes = 0;
    for (const auto& word : block.words) {
      if (word.letter != 'G') continue;
      ++codes;
      const bool own =
          word.value == 0.0 || word.value == 1.0 || (word.value == 53.0 && firmware_.machine_words);
      if (!own) return error(block.at, "only G0 and G1 move the axes of this program");
    }
    const bool machine_words = block.has('G', 53.0);
    machine_words_only_ = machine_words_only_ && machine_words;
    if (codes != (machine_words ? 2 : 1)) return error(block.at, "a code stands twice in a motion");
    ReadBackMove move = new_move(block.at);
    move.rapid = block.has('G', 0.0);
    const Word* f = block.find('F');
    const bool timed = firmware_.feed == FeedRule::inverse_time;
    const bool needs_feed = !move.rapid || firmware_.rapid_needs_feed;
    if (needs_feed != (f != nullptr) || (f != nullptr && f->value <= 0.0))
      return error(block.at, needs_feed ? "this motion needs F above 0" : "F in a block of G0");
    if (timed && !move.rapid && !inverse_time_) return error(block.at, "G1 needs G93");
    const JointVector from = joints();
    const JointMask known_from = known();
    if (!take_axes(block, {"GF", 1.0, Vec3::Zero()})) return;
    move.to = joints();
    move.known = known();
    if (!move.rapid)
      move.duration = timed ? kSecondsPerMinute / f->value
                            : way(block, from, known_from) / f->value * kSecondsPerMinute;
    result.moves.push_back(std::move(move));
  }

  // The way that F is over; 0 when the start of an axis is not known.
  double way(const Block& block, const JointVector& from, JointMask known_from) const {
    double xyz = 0.0, uvw = 0.0, abc = 0.0, most = 0.0;
    for (const auto& word : block.words) {
      const int j = machine().axis_by_letter(word.letter);
      if (j < 0) continue;
      if (!(known_from >> j & 1U)) return 0.0;
      const double d =
          is_rotary(j) ? degrees_from_radians(joints()[j] - from[j]) : joints()[j] - from[j];
      switch (word.letter) {
        case 'X':
        case 'Y':
        case 'Z':
          xyz = std::hypot(xyz, d);
          break;
        case 'U':
        case 'V':
        case 'W':
          uvw = std::hypot(uvw, d);
          most = std::fmax(most, std::abs(d));
          break;
        default:
          abc = std::hypot(abc, d);
          most = std::fmax(most, std::abs(d));
      }
    }
    constexpr double kNoWay = 1e-9;
    if (xyz > kNoWay) return xyz;
    if (firmware_.feed == FeedRule::xyz_or_most) return most;
    return uvw > kNoWay ? uvw : abc;
  }

  const Firmware& firmware_;
  bool unit_ = false;
  bool absolute_ = false;
  bool inverse_time_ = false;
  bool machine_words_only_ = true;
};

}  // namespace

Result<ReadBack> read_back(const MachineDefinition& machine, std::string text,
                           const std::string& file_name) {
  const Firmware* firmware = firmware_of(machine.dialect.name);
  require(firmware != nullptr, "a dialect of the grbl family");
  const gcode::Syntax syntax{250, true, firmware->several_words};
  return read_with<Reading>(machine, file_name, gcode::parse(text, file_name, syntax), *firmware);
}

}  // namespace smoothpost::grbl
