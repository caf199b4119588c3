#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "formats/nc/large_pages.h"

namespace smoothpost::nc {

/// What a piece of program text is. The pieces of a program tile its text: every byte is in exactly
/// one.
enum class PieceKind : std::uint8_t {
  space,         ///< blanks and tabs
  word,          ///< letter and number: G1, X-1.5, N10
  comment,       ///< ( ... ) or ; to the end of the line
  block_delete,  ///< /
  percent,       ///< %
  line_end,      ///< LF, CR LF or CR
  construct,     ///< something of another dialect or a later issue: expression, O-word, # parameter
                 ///< ...
  trailer        ///< text after the second %, which controllers ignore
};

struct Piece {
  PieceKind kind = PieceKind::space;
  char letter = 0;          ///< upper case, kind word
  std::uint32_t begin = 0;  ///< byte offset into Program::text
  std::uint32_t length = 0;
  double value = 0.0;  ///< kind word
};

/// One line of text.
struct Block {
  std::uint32_t first_piece = 0;
  std::uint32_t piece_count = 0;
};

/// NC text as a tree: one block a line, pieces with spans. Line = block index + 1; a piece's column
/// is its offset from the block's first piece + 1.
struct Program {
  std::string file_name;
  std::string text;
  std::vector<Block> blocks;
  std::vector<Piece, LargePageAllocator<Piece>> pieces;
};

/// The text of the program, put together from its pieces: equal to the text that was parsed, byte
/// for byte, whether or not it has errors.
std::string print(const Program& program);

}  // namespace smoothpost::nc
