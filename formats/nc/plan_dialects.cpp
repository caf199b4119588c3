#include <bit>
#include <cmath>

#include "formats/nc/block_plan.h"
#include "formats/nc/number_text.h"

// The rules of one block that differ between the dialects.
namespace smoothpost::nc {
namespace {

constexpr LetterMask kCentreLetters = letter_bit('I') | letter_bit('J') | letter_bit('K');
constexpr AxisMask kRotaryAxes = 0x38;

bool is_arc(GCode motion) { return motion == 20 || motion == 30; }

bool is_pole(GCode code) { return code == 1100 || code == 1110 || code == 1120; }

bool has_frame(const BlockWords& block) {
  return block.says(SiemensWord::trans) || block.says(SiemensWord::atrans) ||
         block.says(SiemensWord::rot) || block.says(SiemensWord::arot) ||
         block.says(SiemensWord::mirror) || block.says(SiemensWord::amirror) ||
         block.says(SiemensWord::scale) || block.says(SiemensWord::ascale);
}

}  // namespace

/// Whether a code or statement of the block uses the axis words itself.
bool BlockPlanner::takes_axes(const BlockWords& block) const {
  const GCode code = block.code(GGroup::non_modal);
  if (code == 100 || code == 280 || code == 300 || code == 520 || code == 920) return true;
  if (dialect_ == InputDialect::linuxcnc) return false;
  if (dialect_ == InputDialect::siemens) {
    return has_frame(block) || code == 580 || code == 590 || is_pole(code);
  }
  // G4 X2.5; G05.1 Q2 X0 Y0 Z0 names the axes that are smoothed.
  const GCode mode = block.code(GGroup::no_effect);
  return code == 40 || code == kMacroCall || (mode == 51 && block.has('Q') && block['Q'] == 2.0);
}

/// Which words of the block are components of the tool axis.
void BlockPlanner::find_vector(const BlockWords& block, const ModalState& modal) {
  if (dialect_ == InputDialect::siemens) {
    plan_.vector = block.letters & kVectorMask;
    return;
  }
  const GCode offset = block.code(GGroup::length_offset);
  const bool active = offset == 435 || (modal.vector_words && offset == kNoCode);
  const GCode written = block.code(GGroup::motion);
  const GCode motion = written == kNoCode ? modal.motion : written;
  if (!active) return;
  if (is_arc(motion) && (block.letters & kCentreLetters) != 0) {
    refuse("NC243",
           "an arc under G43.5 with I J K: they are the tool axis there and no centre; let the CAM "
           "post write R or straight moves",
           reader_.place(block, block.first_piece));
  } else {
    plan_.vector = block.letters & kCentreLetters;
  }
}

void BlockPlanner::check_vector(const BlockWords& block, const ModalState& modal) {
  const bool siemens = dialect_ == InputDialect::siemens;
  std::uint32_t piece = block.first_piece;
  double length = 0.0;
  for (LetterMask left = plan_.vector; left != 0; left &= left - 1) {
    const auto index = static_cast<std::size_t>(std::countr_zero(left));
    length = std::hypot(length, block.value[index]);
    piece = block.piece[index];
  }
  const TextPlace place = reader_.place(block, piece);
  if (siemens && is_arc(plan_.motion)) check_arc_words(block);
  if (siemens && !modal.tcp) {
    refuse("NC243", "a tool axis by A3= B3= C3= outside TRAORI; write TRAORI before it", place);
  } else if (siemens && modal.machine_vectors) {
    refuse("NC243",
           "a tool axis by A3= B3= C3= under ORIMKS is in machine axes, which is not read; let the "
           "CAM post write ORIWKS",
           place);
  } else if (!(length > 1e-9)) {
    refuse("NC243", "the tool axis has no length: all of its components are 0", place);
  } else if ((plan_.axes & kRotaryAxes) != 0) {
    refuse("NC243", "the tool axis is given by a vector and by rotary words; write one of them",
           place);
  } else if (plan_.motion == kNoCode || plan_.motion == 800) {
    refuse("NC209", "a tool axis without a motion mode: no G0, G1, G2 or G3 is active here", place);
  }
}

void BlockPlanner::check_dwell(const BlockWords& block) {
  const TextPlace place = at(block, GGroup::non_modal);
  if (dialect_ == InputDialect::siemens) {
    if (!block.has('F')) {
      refuse("NC217", "G4 is read with F, the seconds to wait", place);
    }
    return;
  }
  const bool linuxcnc = dialect_ == InputDialect::linuxcnc;
  const char letter = linuxcnc || block.has('P') ? 'P' : block.has('X') ? 'X' : 'U';
  if (!block.has(letter) || block[letter] < 0.0) {
    refuse("NC217",
           linuxcnc ? "G4 needs P with the seconds to wait, from 0"
                    : "G4 needs X or U with seconds, or P with milliseconds, from 0",
           place);
  } else if (is_arc(plan_.motion)) {
    refuse("NC217", "G4 and an arc both use P; write them on two lines", place);
  }
}

void BlockPlanner::check_machine_position(const BlockWords& block, const ModalState& modal) {
  const bool supa = block.says(SiemensWord::supa);
  const std::string code = supa ? "SUPA" : g_code_text(block.code(GGroup::non_modal));
  const TextPlace place =
      supa ? reader_.place(block, block.statement_piece) : at(block, GGroup::non_modal);
  const GCode distance = block.code(GGroup::distance);
  if (plan_.motion == kNoCode && dialect_ == InputDialect::siemens) return;
  if (plan_.motion != 0 && plan_.motion != 10) {
    if (modal.motion == kRefusedMotion) return;
    refuse("NC216", code + " needs G0 or G1 and axis words in its block", place);
  } else if (distance == 910 || (distance == kNoCode && modal.incremental)) {
    refuse("NC216", code + " cannot be incremental; write G90", place);
  }
}

/// G65: a number behind P, a count behind L; G, M, N, O and axis words of a motion have no place.
void BlockPlanner::check_macro_call(const BlockWords& block) {
  const TextPlace place = at(block, GGroup::non_modal);
  if (block.code(GGroup::motion) != kNoCode || block.m_count != 0) {
    refuse("NC256", "G65 and its arguments stand alone; write other codes on a line before", place);
  }
}

bool BlockPlanner::check_fanuc_g10(const BlockWords& block) {
  if (block.has('L') && block['L'] == 2.0 && block.has('P') && block['P'] >= 0.5 &&
      block['P'] <= 6.5 && !block.has('R')) {
    return true;
  }
  refuse("NC218",
         "G10 is read with L2 P1 to P6 (work offsets) only; give tool lengths by --tool N=LENGTH",
         at(block, GGroup::non_modal));
  return false;
}

/// Letters beside the axis words that have a meaning in the block.
LetterMask BlockPlanner::letters_of_dialect(const BlockWords& block,
                                            const ModalState& modal) const {
  LetterMask used = plan_.vector;
  if (dialect_ == InputDialect::siemens) {
    used |= letter_bit('D');
    if (is_arc(plan_.motion)) {
      used |= letter_bit(kCircleRadius) | letter_bit(kCircleTurns) | letter_bit(kArcAngle);
    }
    if (plan_.motion == kPolynomial) used |= letter_bit(kParameterLength);
    if (is_pole(block.code(GGroup::non_modal))) {
      used |= letter_bit(kPolarAngle) | letter_bit(kPolarRadius);
    }
    if (plan_.motion == kPointArc) {
      used |= letter_bit(kThroughX) | letter_bit(kThroughY) | letter_bit(kThroughZ);
    }
    if (block.says(SiemensWord::rot) || block.says(SiemensWord::arot)) {
      used |= letter_bit(kPlaneAngle);
    }
    return used & block.letters;
  }
  const GCode offset = block.code(GGroup::length_offset);
  if (offset == 434 || offset == 435 || offset == 2340 || offset == 490) used |= letter_bit('H');
  if (modal.vector_words || offset == 435) used |= letter_bit('Q');  // tilt angle of G43.5
  if (block.code(GGroup::non_modal) == 300) used |= letter_bit('P');
  switch (block.code(GGroup::no_effect)) {
    case 51:
      used |= letter_bit('P') | letter_bit('Q') | letter_bit('R');
      break;
    case 50:
    case 80:
    case 630:
    case 1030:
      used |= letter_bit('P');
      break;
    case 1870:
      used |= letter_bit('P') | letter_bit('E');
      break;
    default:
      break;
  }
  return used & block.letters;
}

}  // namespace smoothpost::nc
