#pragma once

#include <string>
#include <string_view>

#include "machines/dialects/gcode_text.h"
#include "machines/dialects/program_printer.h"
#include "machines/dialects/program_reading.h"

// Printing and reading of programs whose blocks are G-code, for controllers that differ in their
// words only.
namespace smoothpost::gcode {

class GcodePrinter : public ProgramPrinter {
 protected:
  struct Numbers {
    std::uint32_t step = 10;
    std::uint32_t last = 99999;  ///< blocks behind it have no number
  };
  GcodePrinter(const MachineDefinition& machine, const MachineProgram& program,
               AxisWords::Style style, Numbers numbers);

  /// A line with its number, where dialect.line_numbers asks for it.
  void block(std::string_view words);
  /// A line of the machine file: without number when it is a comment, % or the program's name.
  void own_line(const std::string& text);
  /// (text), in characters that end no comment.
  void comment(const std::string& text) override;
  void statement(const std::string& words, const MachineAction& action) override;

  AxisWords& words() { return words_; }
  const AxisWords& words() const { return words_; }
  /// F of a block that lasts `seconds`, as one over minutes, with its letter.
  std::string inverse_time(double seconds) const;
  /// The words of an arc that begins at `from`: "G17 G2" and " I1.5 J-2".
  struct ArcCode {
    std::string code, centre;
  };
  ArcCode arc_code(const MachineMove& move, const JointVector& from);
  /// G17 again, if an arc has chosen another plane: words of the machine file may rely on it.
  void leave_plane();
  bool has_arcs() const { return has_arcs_; }
  bool is_inch() const { return machine().dialect.units == "inch"; }

 private:
  AxisWords words_;
  Numbers numbers_;
  bool has_arcs_ = false;
  int plane_ = 17;
  std::uint32_t number_ = 0;
};

/// Follows blocks. A derived class says what motions and modal words are, and what guards.
class GcodeReading : public ProgramReading {
 public:
  void run(const Parsed& program);

 protected:
  GcodeReading(const MachineDefinition& machine, const std::string& file);
  virtual ~GcodeReading() = default;

  /// Takes a block of the guard, before the first motion; false when it is none.
  virtual bool take_guard(const Block&) { return false; }
  /// A block with G0, G1, G2 or G3.
  virtual void read_motion(const Block& block) = 0;
  /// A block of modal words; false, with nothing changed, when it holds another word.
  virtual bool read_setting(const Block& block) = 0;
  /// A block that is not all words; false when it is none of this control's.
  virtual bool read_statement(const Block&) { return false; }
  /// Behind the last block.
  virtual void finish() {}

  /// X Y Z A B C U V W P Q words of the block into the joints, those in `others` left out. `scale`
  /// makes mm of a length, `shift` is added to X Y Z. False after an error.
  struct AxisRule {
    std::string_view others;
    double scale = 1.0;
    Vec3 shift = Vec3::Zero();
  };
  bool take_axes(const Block& block, const AxisRule& rule);
  /// The arc of a block with G2 or G3 whose axes have been taken into `move`, from where they stood
  /// before. It has to name its plane (G17, G18 or G19), both centre words of it from the start,
  /// and no others of I J K R P. False after an error.
  struct ArcStart {
    JointVector joints;
    JointMask known = 0;
    double scale = 1.0;  ///< makes mm of a length
  };
  bool take_arc(const Block& block, const ArcStart& start, ReadBackMove& move);
  static bool is_arc(const Block& block) { return block.has('G', 2.0) || block.has('G', 3.0); }
  /// A dwell of `seconds`, with an error unless they are a number from 0 on.
  void dwell(const Block& block, const Word* seconds, double unit);

 private:
  void read(const Block& block);
  bool acts_on_motion(const Block& block) const;
};

}  // namespace smoothpost::gcode
