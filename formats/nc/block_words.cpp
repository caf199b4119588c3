#include "formats/nc/block_words.h"

#include <algorithm>
#include <cmath>

#include "formats/nc/interpreter.h"
#include "formats/nc/number_text.h"

namespace smoothpost::nc {

const BlockWords& BlockReader::read(std::size_t index) {
  const Block& block = program_->block(index);
  block_.line = static_cast<std::uint32_t>(index) + 1;
  block_.input_line = input_line_ == 0 ? block_.line : input_line_;
  block_.letters = block_.absolute = block_.incremental = 0;
  block_.senses = 0;
  block_.statements = 0;
  block_.statement_piece = block_.flow_piece = BlockWords::kNone;
  block_.g.fill(kNoCode);
  block_.m_count = 0;
  block_.first_piece = block.first_piece;
  block_.comment_piece = BlockWords::kNone;
  block_.deleted = block_.bad = block_.percent = block_.words = false;
  const std::uint32_t end = block.first_piece + block.piece_count;
  bool assigns = false;
  for (std::uint32_t i = block.first_piece; i < end; ++i) {
    const Piece& piece = program_->pieces[i];
    switch (piece.kind) {
      case PieceKind::word:
        add_word(piece, i);
        break;
      case PieceKind::comment:
        block_.comment_piece = i;
        break;
      case PieceKind::block_delete:
        block_.deleted = true;
        break;
      case PieceKind::percent:
        block_.percent = true;
        break;
      case PieceKind::construct:
        add_construct(i);
        break;
      case PieceKind::assignment:
        assigns = true;
        assign(i);
        break;
      case PieceKind::statement:
        add_statement(piece, i);
        break;
      case PieceKind::flow:
        block_.flow_piece = i;
        block_.words = true;
        break;
      case PieceKind::space:
      case PieceKind::line_end:
      case PieceKind::trailer:
        break;
    }
  }
  if (assigns) values_.finish_block(!block_.bad);
  if (block_.has('X')) halve_diameter();
  return block_;
}

/// G7 and G8 count for the X word of their own block too, wherever they stand in it.
void BlockReader::halve_diameter() {
  const GCode mode = block_.code(GGroup::lathe_diameter);
  if (mode == kNoCode ? values_.diameter() : mode == 70)
    block_.value[static_cast<std::size_t>(letter_index('X'))] *= 0.5;
}

/// The parser has kept what is wrong behind the end of the program for a subroutine that is called.
bool BlockReader::tell_late_faults() {
  const auto& faults = program_->late_faults;
  auto fault =
      std::lower_bound(faults.begin(), faults.end(), block_.line,
                       [](const LateFault& f, std::uint32_t line) { return f.line < line; });
  const bool any = fault != faults.end() && fault->line == block_.line;
  for (; fault != faults.end() && fault->line == block_.line; ++fault) {
    log_.error(fault->code, fault->text, {fault->line, fault->column});
  }
  return any;
}

/// The parser has named each of these; here only the first is told, so that nobody runs such a
/// program.
void BlockReader::add_construct(std::uint32_t index) {
  block_.bad = block_.words = true;
  if (tell_late_faults() || construct_told_) return;
  construct_told_ = true;
  refuse("NC200",
         "this line has text that could not be read: \"" + text(index) + "\"; mend what " +
             "the reader named",
         index);
}

inline void BlockReader::put(const Piece& piece, std::uint32_t index, double value) {
  if (piece.letter == 'G') return add_g(value, index);
  if (piece.letter == 'M') return add_m(value, index);
  if (piece.letter == 'N' || piece.letter == 'O') {
    if (value < 0.0) refuse("NC206", text(index) + " has a sign; write a number", index);
    return;
  }
  const auto letter = static_cast<std::size_t>(letter_index(piece.letter));
  const LetterMask bit = LetterMask{1} << letter;
  if (block_.letters & bit) {
    refuse("NC205",
           joined({"two ", address_text(piece.letter), " words in one block, ",
                   text(block_.piece[letter]), " and ", text(index), "; write one"}),
           index);
    return;
  }
  block_.letters |= bit;
  block_.value[letter] = value;
  block_.piece[letter] = index;
}

void BlockReader::add_word(const Piece& piece, std::uint32_t index) {
  block_.words = true;
  const bool plain = piece.detail == 0 && !(checks_points_ && piece.value != 0.0);
  if (plain) return put(piece, index, piece.value);
  if (piece.detail != 0) return add_value(piece, index);
  put(piece, index, in_increments(piece, index));
}

void BlockReader::add_value(const Piece& piece, std::uint32_t index) {
  const auto form = static_cast<WordForm>(piece.detail);
  if (form == WordForm::name) return put(piece, index, 0.0);
  const Evaluated found = values_.word(raw(index), form);
  if (!found.ok()) {
    block_.bad = true;
    TextPlace where = place(block_, index);
    where.column += static_cast<std::uint32_t>(found.at);
    log_.error("NC131", text(index) + " has no value: " + found.problem, where);
    return;
  }
  if (piece.letter >= 'A') {
    const LetterMask bit = letter_bit(piece.letter);
    if (form == WordForm::absolute) block_.absolute |= bit;
    if (form == WordForm::incremental) block_.incremental |= bit;
    if (form >= WordForm::shortest) {
      block_.absolute |= bit;
      block_.senses |= static_cast<std::uint32_t>(form) << (8 * (piece.letter - 'A'));
    }
  }
  put(piece, index, found.value);
}

/// A number without a decimal point counts whole units on one control and least increments on
/// another.
double BlockReader::in_increments(const Piece& piece, std::uint32_t index) {
  constexpr LetterMask kLengths = kAxisLetterMask | letter_bit('I') | letter_bit('J') |
                                  letter_bit('K') | letter_bit('R') | letter_bit('F');
  if (piece.letter == 'G' || has_point(index)) return piece.value;
  const GCode motion = block_.code(GGroup::motion);
  const bool drills = is_cycle(motion) || (motion == kNoCode && values_.in_cycle());
  // Of cycles K is a count and Q a length.
  if (drills && piece.letter == 'K') return piece.value;
  if (!(drills && piece.letter == 'Q') && (letter_bit(piece.letter) & kLengths) == 0) {
    return piece.value;
  }
  // R of G05.1 is a level.
  if (piece.letter == 'R' && block_.code(GGroup::no_effect) == 51) return piece.value;
  const GCode unit = block_.code(GGroup::units);
  const bool inch = unit == kNoCode ? values_.inch() : unit == 200;
  const bool feed = piece.letter == 'F';
  // A feed in whole millimetres per minute means the same on every Fanuc.
  if (feed && !inch && program_->dialect == InputDialect::fanuc) return piece.value;
  const double increment = settings_.integer_increment.value_or(0.0);
  if (increment == 1.0) return piece.value;
  if (increment > 0.0 && !feed) {
    const bool rotary = piece.letter >= 'A' && piece.letter <= 'C';
    return piece.value * (inch && !rotary ? 0.1 * increment : increment);
  }
  block_.bad = true;
  const LetterMask bit = letter_bit(piece.letter);
  if ((points_told_ & bit) != 0) return piece.value;
  points_told_ |= bit;
  refuse("NC240",
         joined({text(index), " has no decimal point: it may mean ", text(index),
                 ". or as many least increments, as the control is set (first of such ",
                 std::string_view(&piece.letter, 1),
                 " words); let the CAM post write the point, "
                 "or say what it means by --integer-unit 1 or 0.001"}),
         index);
  return piece.value;
}

void BlockReader::add_statement(const Piece& piece, std::uint32_t index) {
  block_.words = true;
  const auto word = static_cast<SiemensWord>(piece.detail);
  if (word == SiemensWord::no_effect) return;
  if (word == SiemensWord::program_name) return;
  if (word == SiemensWord::declaration || word == SiemensWord::procedure ||
      word == SiemensWord::further_procedure) {
    return assign(index);
  }
  block_.statements |= 1u << static_cast<unsigned>(word);
  block_.statement_piece = index;
}

void BlockReader::assign(std::uint32_t index) {
  block_.words = true;
  const Evaluated found = values_.assign(raw(index));
  if (found.ok()) return;
  block_.bad = true;
  TextPlace where = place(block_, index);
  where.column += static_cast<std::uint32_t>(found.at);
  log_.error("NC132", text(index) + " cannot be done: " + found.problem, where);
}

void BlockReader::add_g(double value, std::uint32_t index) {
  const double tenfold = value * 10.0;
  const double nearest = std::round(tenfold);
  if (!(tenfold > -0.5 && tenfold < 10000.0) || std::abs(tenfold - nearest) > 1e-3) {
    refuse("NC201", text(index) + " is no G code of this language", index);
    return;
  }
  const auto code = static_cast<GCode>(nearest);
  const GCodeInfo& info = g_code_info(code, program_->dialect);
  if (!is_g_allowed(info, code, index)) return;
  const auto group = static_cast<std::size_t>(info.group);
  // G80 beside another motion code has no effect.
  constexpr GCode kG80 = 800;
  if (code == kG80 && block_.g[group] != kNoCode) return;
  if (block_.g[group] != kNoCode && block_.g[group] != kG80) {
    if (info.group == GGroup::no_effect) {
      const bool has_words = code == 50 || code == 51 || code == 80 || code == 1030 || code == 1870;
      if (has_words) block_.g[group] = code;
      return;
    }
    refuse("NC204",
           g_code_text(block_.g[group]) + " and " + g_code_text(code) +
               " are of one modal group; write them on two lines",
           index);
    return;
  }
  block_.g[group] = code;
  block_.g_piece[group] = index;
}

/// A code that is refused still stands for its group, so that the messages of the block fit.
bool BlockReader::is_g_allowed(const GCodeInfo& info, GCode code, std::uint32_t index) {
  if (info.status == GStatus::tcp) {
    const bool linuxcnc = program_->dialect == InputDialect::linuxcnc;
    refuse("NC203",
           g_code_text(code) + " (" + info.name +
               (linuxcnc ? ") is a mode of another control: name it by --input-dialect, or post "
                           "the program for M428/M429 or with joint words outside any such mode"
                         : ") is not read in this version; post the program for tool-centre-point "
                           "mode (G43.4, G43.5) or with joint words outside any such mode"),
           index);
  } else if (info.status == GStatus::later) {
    refuse("NC202",
           g_code_text(code) + " (" + info.name +
               ") is not read in this version; let the CAM post write straight moves and "
               "arcs (G1, G2, G3) without it",
           index);
  } else if (info.status == GStatus::synchronised) {
    refuse("NC202",
           g_code_text(code) + " (" + info.name +
               ") ties the feed to the turning of the spindle, which the planned motion does not "
               "follow; let the CAM post write G94 feeds, or keep this operation on its control",
           index);
  } else if (is_probe(code) && settings_.plain_blocks) {
    refuse("NC202",
           g_code_text(code) + " (" + info.name +
               ") stops where the probe says, which a machine program of planned motions does not",
           index);
  } else if (info.status == GStatus::expanded && settings_.plain_blocks) {
    refuse("NC202",
           g_code_text(code) + " (" + info.name +
               ") stands for motions that a machine program writes out; write them",
           index);
  } else if (info.status == GStatus::unknown) {
    refuse("NC201", g_code_text(code) + " is no G code of this language", index);
    return false;
  }
  return true;
}

void BlockReader::add_m(double value, std::uint32_t index) {
  const double nearest = std::round(value);
  if (!(value > -0.5 && value < 1e6) || std::abs(value - nearest) > 1e-4 || nearest > 32767.0) {
    refuse("NC206", text(index) + " is no M code: a whole number from 0 is needed", index);
    return;
  }
  const auto m = static_cast<std::int16_t>(nearest);
  if (const char* why = m_refusal(m, program_->dialect, settings_.plain_blocks)) {
    refuse("NC226", "M" + std::to_string(m) + ": " + why + "; let the CAM post write without it",
           index);
    return;
  }
  for (int i = 0; i < block_.m_count; ++i) {
    const int other = block_.m[static_cast<std::size_t>(i)];
    const bool grouped = m_group(m) >= 0 && m_group(m) == m_group(other) && m_group(m) != 10;
    if (other == m || (grouped && program_->dialect != InputDialect::siemens)) {
      refuse("NC207",
             "M" + std::to_string(other) + " and M" + std::to_string(m) +
                 " are of one modal group; write them on two lines",
             index);
      return;
    }
  }
  if (block_.m_count == BlockWords::kMaxM) {
    refuse("NC208", "more than 4 M words in one block; write them on two lines", index);
    return;
  }
  const auto slot = static_cast<std::size_t>(block_.m_count++);
  block_.m[slot] = m;
  block_.m_piece[slot] = index;
}

void BlockReader::refuse(const char* code, std::string message, std::uint32_t piece) {
  block_.bad = true;
  log_.error(code, std::move(message), place(block_, piece));
}

TextPlace BlockReader::place(const BlockWords& block, std::uint32_t piece) const {
  if (piece == BlockWords::kNone) return {block.line, 1};
  return {block.line,
          program_->pieces[piece].begin - program_->pieces[block.first_piece].begin + 1};
}

std::string BlockReader::text(std::uint32_t index) const {
  const Piece& piece = program_->pieces[index];
  std::string out;
  for (std::uint32_t i = piece.begin; i < piece.begin + piece.length && out.size() < 60; ++i) {
    const char c = program_->text[i];
    if (c == ' ' || c == '\t') continue;
    const bool lower = piece.kind == PieceKind::word &&
                       piece.detail != static_cast<std::uint8_t>(WordForm::name) && c >= 'a' &&
                       c <= 'z';
    const auto byte = static_cast<unsigned char>(c);
    out.push_back(lower ? static_cast<char>(c - 32) : byte < 32 || byte > 126 ? '?' : c);
  }
  return out;
}

}  // namespace smoothpost::nc
