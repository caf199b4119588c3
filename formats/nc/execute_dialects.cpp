#include <cmath>

#include "formats/nc/executor.h"
#include "formats/nc/number_text.h"
#include "kernels/core/units.h"

// What Sinumerik and the Fanuc family have and RS274NGC has not: tool edges, tool axes by vector.
namespace smoothpost::nc {
namespace {

constexpr AxisMask kRotaryAxes = 0x38;

// Warnings that are told once a program.
constexpr unsigned kWarnCycle832 = 0, kWarnSwivel = 1, kWarnHighSpeed = 2, kWarnLength = 3,
                   kWarnAxes = 4, kWarnGreatCircle = 5;

/// What stands between the parentheses of MSG(..), and its first quoted text.
std::string_view inside(std::string_view statement) {
  const std::size_t open = statement.find('(');
  return statement.substr(open + 1, statement.size() - open - 2);
}

std::string_view message_text(std::string_view statement) {
  const std::size_t open = statement.find('(');
  const std::size_t quote = statement.find('"', open);
  const std::size_t close =
      quote == std::string_view::npos ? quote : statement.find('"', quote + 1);
  if (close != std::string_view::npos) return statement.substr(quote + 1, close - quote - 1);
  return inside(statement);
}

}  // namespace

void Executor::warn_once(unsigned which, std::string text, const BlockWords& block,
                         std::uint32_t piece) {
  if (((warned_ >> which) & 1u) != 0) return;
  warned_ |= 1u << which;
  log_.warning("NC244", std::move(text), reader_.place(block, piece));
}

void Executor::warn_dialect(const BlockWords& block) {
  if (block.code(GGroup::no_effect) != 50) return;
  warn_once(kWarnHighSpeed, "G05 is a mode of the control for short blocks; it does nothing here",
            block, block.g_piece[static_cast<std::size_t>(GGroup::no_effect)]);
}

/// What the statements of a Sinumerik block do before its motion.
void Executor::statements(const BlockWords& block) {
  if (block.says(SiemensWord::message)) {
    const std::string_view text = reader_.raw(block.statement_piece);
    message(values_->text(inside(text)).value_or(std::string(message_text(text))), block.input_line,
            reader_.input_place(block, block.statement_piece).column);
  }
  if (block.says(SiemensWord::cycle832)) {
    warn_once(kWarnCycle832,
              "CYCLE832 sets tolerances of the control; it does nothing here: tolerances are those "
              "of the machine file and the command line",
              block, block.statement_piece);
  }
  if (block.says(SiemensWord::swivel)) swivel(block);
  if (block.says(SiemensWord::no_swivel) && modal_.swivelled) {
    leave_plane();
  } else if (block.says(SiemensWord::no_swivel)) {
    warn_once(kWarnSwivel,
              "CYCLE800() ends a swivelled plane; none is active, it does nothing here", block,
              block.statement_piece);
  }
  if (block.says(SiemensWord::orimks)) modal_.machine_vectors = true;
  if (block.says(SiemensWord::oriwks)) modal_.machine_vectors = false;
  if (block.says(SiemensWord::orivect)) modal_.great_circle = true;
  if (block.says(SiemensWord::oriaxes)) modal_.great_circle = false;
  if (block.says(SiemensWord::oriaxes)) modal_.linear_axes = true;
  if (block.says(SiemensWord::orivect)) modal_.linear_axes = false;
  if (block.says(SiemensWord::orieuler)) modal_.axis_angles = AxisAngles::euler;
  if (block.says(SiemensWord::orirpy)) modal_.axis_angles = AxisAngles::roll_pitch_yaw;
  if (block.says(SiemensWord::oriother)) modal_.axis_angles = AxisAngles::none;
  if (block.says(SiemensWord::traori) && modal_.swivelled) {
    log_.error("NC245", "TRAORI in the plane of CYCLE800 is not read; write CYCLE800() before",
               reader_.place(block, block.statement_piece));
  }
  if (block.says(SiemensWord::traori)) set_tcp(true);
  if (block.says(SiemensWord::trafoof)) set_tcp(false);
  if (block.says(SiemensWord::offset_data)) take_offset_data(block);
  change_frame(block);
}

void Executor::change_tool(const BlockWords& block) {
  modal_.tool_changed = true;
  modal_.spindle_tool = modal_.words.tool;
  modal_.spindle_tool_name = modal_.words.tool_name;
  summary_.tools.push_back(modal_.spindle_tool);
  // The first edge of a new tool is active at once.
  if (is_siemens() && !block.has('D')) tool_edge(block);
}

/// D0: no length; any other edge: the length of the tool, when it was given.
void Executor::tool_edge(const BlockWords& block) {
  if (block.has('D') && block['D'] == 0.0) return set_tool_length(0.0, 0, block.input_line);
  const bool changed = modal_.tool_changed;
  const int tool = changed ? modal_.spindle_tool : modal_.words.tool;
  const std::string& name = changed ? modal_.spindle_tool_name : modal_.words.tool_name;
  const auto found = settings_.tool_lengths.find(tool);
  if (name.empty() && found != settings_.tool_lengths.end()) {
    return set_tool_length(found->second, tool, block.input_line);
  }
  const std::uint32_t piece = block.has('D') ? block.piece[letter_index('D')] : block.first_piece;
  if (tool != 0 || !name.empty()) {
    warn_once(kWarnLength,
              "the length of tool " + (name.empty() ? std::to_string(tool) : "\"" + name + "\"") +
                  " is not given: the program describes the tip, machine positions are taken with "
                  "length 0 (first of such tools); give lengths by --tool N=LENGTH (mm)",
              block, piece);
  }
  set_tool_length(0.0, tool, block.input_line);
}

/// The tool-centre-point modes of the Fanuc family are tool length offsets.
void Executor::set_tcp_by_offset(GCode code) {
  modal_.vector_words = code == 435;
  set_tcp(code == 434 || code == 435 || code == 2340);
}

/// The tool axis at both ends of a motion in tool-centre-point mode.
void Executor::turn_axis(const BlockWords& block, const BlockPlan& plan) {
  if (!coordinates_.rigid() && (plan.vector != 0 || (plan.axes & kRotaryAxes) != 0)) {
    log_.error("NC245",
               "a tool axis under MIRROR or SCALE: what the control makes of it is not stated; let "
               "the CAM post write it without them",
               at(block, GGroup::motion));
  }
  if (plan.vector != 0) {
    constexpr char kSiemens[] = {kAxisVectorX, kAxisVectorY, kAxisVectorZ};
    constexpr char kFanuc[] = {'I', 'J', 'K'};
    Vec3 vector = Vec3::Zero();
    for (int i = 0; i < 3; ++i) {
      const char letter = is_siemens() ? kSiemens[i] : kFanuc[i];
      if (block.has(letter)) vector[i] = block[letter];
    }
    motion_.axis_vector = true;
    motion_.start_axis = modal_.axis;
    motion_.end_axis = coordinates_.world_direction(vector).normalized();
    if (modal_.linear_axes) {
      warn_once(
          kWarnAxes,
          "ORIAXES with A3= B3= C3=: the tool axis is taken to turn on a great circle between "
          "the programmed vectors, the control moves its rotary axes linearly",
          block, block.first_piece);
    }
  } else if ((plan.axes & kRotaryAxes) != 0) {
    modal_.by_vector = false;
    modal_.axis = Vec3::Zero();
    if (modal_.great_circle) {
      warn_once(kWarnGreatCircle,
                "ORIVECT with rotary words: the rotary axes are taken to move linearly between the "
                "programmed positions, the control turns the tool axis on a great circle",
                block, block.first_piece);
    }
    return;
  } else if (modal_.by_vector) {
    motion_.axis_vector = true;
    motion_.start_axis = motion_.end_axis = modal_.axis;
  } else {
    return;
  }
  // With a vector the bits of A B C say whether the axis is unknown.
  const auto known = [](AxisMask words, const Vec3& axis) {
    return static_cast<AxisMask>(axis.isZero() ? words | kRotaryAxes : words & ~kRotaryAxes);
  };
  motion_.unknown_start = known(motion_.unknown_start, motion_.start_axis);
  motion_.unknown_end = known(motion_.unknown_end, motion_.end_axis);
  modal_.by_vector = true;
  modal_.axis = motion_.end_axis;
}

}  // namespace smoothpost::nc
