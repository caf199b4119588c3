#pragma once

#include <array>
#include <cstdint>
#include <string>

#include "formats/nc/codes.h"
#include "formats/nc/diagnostic_log.h"
#include "formats/nc/program.h"

namespace smoothpost::nc {

/// A set of word letters: bit 0 is A, bit 25 is Z.
using LetterMask = std::uint32_t;

constexpr int letter_index(char letter) { return letter - 'A'; }
constexpr LetterMask letter_bit(char letter) { return LetterMask{1} << letter_index(letter); }

/// Letters of the axis words in the bits of LetterMask.
inline constexpr LetterMask kAxisLetterMask = letter_bit('X') | letter_bit('Y') | letter_bit('Z') |
                                              letter_bit('A') | letter_bit('B') | letter_bit('C') |
                                              letter_bit('U') | letter_bit('V') | letter_bit('W');

/// The words of one block, by letter, by modal group and as a list of M words.
struct BlockWords {
  static constexpr int kMaxM = 4;

  std::uint32_t line = 0;
  LetterMask letters = 0;  ///< all but G, M, N, O
  std::array<double, 26> value;
  std::array<std::uint32_t, 26> piece;
  std::array<GCode, kGGroups> g;
  std::array<std::uint32_t, kGGroups> g_piece;
  std::array<std::int16_t, kMaxM> m;
  std::array<std::uint32_t, kMaxM> m_piece;
  int m_count = 0;
  std::uint32_t first_piece = 0;
  std::uint32_t comment_piece = kNone;  ///< the last comment of the line
  bool deleted = false;                 ///< begins with /
  bool bad = false;                     ///< has text or words that were refused
  bool percent = false;
  bool words = false;  ///< any word at all

  static constexpr std::uint32_t kNone = 0xffffffff;

  bool has(char letter) const { return (letters & letter_bit(letter)) != 0; }
  double operator[](char letter) const {
    return value[static_cast<std::size_t>(letter_index(letter))];
  }
  GCode code(GGroup group) const { return g[static_cast<std::size_t>(group)]; }
  bool has_m(int number) const {
    for (int i = 0; i < m_count; ++i) {
      if (m[static_cast<std::size_t>(i)] == number) return true;
    }
    return false;
  }
};

/// Sorts the pieces of blocks into BlockWords and refuses what no block may hold: unknown and
/// unread G codes, two words of one modal group, a letter twice, more than four M words.
class BlockReader {
 public:
  BlockReader(const Program& program, DiagnosticLog& log) : program_(program), log_(log) {}

  /// @pre index < program.blocks.size(). Valid until the next call.
  const BlockWords& read(std::size_t index);

  TextPlace place(const BlockWords& block, std::uint32_t piece) const;
  /// The word as written, upper case, without blanks.
  std::string text(std::uint32_t piece) const;

 private:
  void add_construct(std::uint32_t index);
  void add_word(const Piece& piece, std::uint32_t index);
  void add_g(const Piece& piece, std::uint32_t index);
  void add_m(const Piece& piece, std::uint32_t index);
  void refuse(const char* code, std::string text, std::uint32_t piece);

  const Program& program_;
  DiagnosticLog& log_;
  BlockWords block_;
  bool construct_told_ = false;
};

}  // namespace smoothpost::nc
