#include "formats/nc/program.h"

namespace smoothpost::nc {

std::string print(const Program& program) {
  std::string out;
  out.reserve(program.text.size());
  for (const Block& block : program.blocks) {
    for (std::uint32_t i = 0; i < block.piece_count; ++i) {
      const Piece& piece = program.pieces[block.first_piece + i];
      out.append(program.text, piece.begin, piece.length);
    }
  }
  return out;
}

}  // namespace smoothpost::nc
