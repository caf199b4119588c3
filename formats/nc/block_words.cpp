#include "formats/nc/block_words.h"

#include <cmath>

#include "formats/nc/number_text.h"

namespace smoothpost::nc {

const BlockWords& BlockReader::read(std::size_t index) {
  const Block& block = program_.blocks[index];
  block_.line = static_cast<std::uint32_t>(index) + 1;
  block_.letters = 0;
  block_.g.fill(kNoCode);
  block_.m_count = 0;
  block_.first_piece = block.first_piece;
  block_.comment_piece = BlockWords::kNone;
  block_.deleted = block_.bad = block_.percent = block_.words = false;
  const std::uint32_t end = block.first_piece + block.piece_count;
  for (std::uint32_t i = block.first_piece; i < end; ++i) {
    const Piece& piece = program_.pieces[i];
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
      case PieceKind::space:
      case PieceKind::line_end:
      case PieceKind::trailer:
        break;
    }
  }
  return block_;
}

/// The parser has named each of these; here only the first is told, so that nobody runs such a
/// program.
void BlockReader::add_construct(std::uint32_t index) {
  block_.bad = block_.words = true;
  if (construct_told_) return;
  construct_told_ = true;
  refuse("NC200",
         "this line has text that could not be read: \"" + text(index) + "\"; mend what " +
             "the reader named",
         index);
}

void BlockReader::add_word(const Piece& piece, std::uint32_t index) {
  block_.words = true;
  if (piece.letter == 'G') return add_g(piece, index);
  if (piece.letter == 'M') return add_m(piece, index);
  if (piece.letter == 'N' || piece.letter == 'O') {
    if (piece.value < 0.0) refuse("NC206", text(index) + " has a sign; write a number", index);
    return;
  }
  const auto letter = static_cast<std::size_t>(letter_index(piece.letter));
  const LetterMask bit = LetterMask{1} << letter;
  if (block_.letters & bit) {
    refuse("NC205",
           joined({"two ", std::string_view(&piece.letter, 1), " words in one block, ",
                   text(block_.piece[letter]), " and ", text(index), "; write one"}),
           index);
    return;
  }
  block_.letters |= bit;
  block_.value[letter] = piece.value;
  block_.piece[letter] = index;
}

void BlockReader::add_g(const Piece& piece, std::uint32_t index) {
  const double tenfold = piece.value * 10.0;
  const double nearest = std::round(tenfold);
  if (!(tenfold > -0.5 && tenfold < 10000.0) || std::abs(tenfold - nearest) > 1e-3) {
    refuse("NC201", text(index) + " is no G code of this language", index);
    return;
  }
  const auto code = static_cast<GCode>(nearest);
  const GCodeInfo& info = g_code_info(code);
  if (info.status == GStatus::tcp) {
    refuse("NC203",
           g_code_text(code) + " (" + info.name +
               ") is read in a later version; post the program for M428/M429 or with "
               "joint words outside any such mode",
           index);
  } else if (info.status == GStatus::later) {
    refuse("NC202",
           g_code_text(code) + " (" + info.name +
               ") is not read in this version; let the CAM post write straight moves and "
               "arcs (G1, G2, G3) without it",
           index);
  } else if (info.status == GStatus::unknown) {
    refuse("NC201", g_code_text(code) + " is no G code of this language", index);
    return;
  }
  const auto group = static_cast<std::size_t>(info.group);
  // G80 beside another motion code has no effect.
  constexpr GCode kG80 = 800;
  if (code == kG80 && block_.g[group] != kNoCode) return;
  if (block_.g[group] != kNoCode && block_.g[group] != kG80) {
    refuse("NC204",
           g_code_text(block_.g[group]) + " and " + g_code_text(code) +
               " are of one modal group; write them on two lines",
           index);
    return;
  }
  block_.g[group] = code;
  block_.g_piece[group] = index;
}

void BlockReader::add_m(const Piece& piece, std::uint32_t index) {
  const double nearest = std::round(piece.value);
  if (!(piece.value > -0.5 && piece.value < 1e6) || std::abs(piece.value - nearest) > 1e-4 ||
      nearest > 32767.0) {
    refuse("NC206", text(index) + " is no M code: a whole number from 0 is needed", index);
    return;
  }
  const auto m = static_cast<std::int16_t>(nearest);
  if (const char* why = m_refusal(m)) {
    refuse("NC226", "M" + std::to_string(m) + ": " + why + "; let the CAM post write without it",
           index);
    return;
  }
  for (int i = 0; i < block_.m_count; ++i) {
    const int other = block_.m[static_cast<std::size_t>(i)];
    if (other == m || (m_group(m) >= 0 && m_group(m) == m_group(other) && m_group(m) != 10)) {
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
  return {block.line, program_.pieces[piece].begin - program_.pieces[block.first_piece].begin + 1};
}

std::string BlockReader::text(std::uint32_t index) const {
  const Piece& piece = program_.pieces[index];
  std::string out;
  for (std::uint32_t i = piece.begin; i < piece.begin + piece.length && out.size() < 60; ++i) {
    const char c = program_.text[i];
    if (c == ' ' || c == '\t') continue;
    const bool lower = piece.kind == PieceKind::word && c >= 'a' && c <= 'z';
    const auto byte = static_cast<unsigned char>(c);
    out.push_back(lower ? static_cast<char>(c - 32) : byte < 32 || byte > 126 ? '?' : c);
  }
  return out;
}

}  // namespace smoothpost::nc
