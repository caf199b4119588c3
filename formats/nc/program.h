#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "formats/nc/large_pages.h"

namespace smoothpost::nc {

/// The language of a controller. Dialects differ in their text and in what words mean.
enum class InputDialect : std::uint8_t { linuxcnc, fanuc, haas, siemens };

/// What a piece of program text is. The pieces of a program tile its text: every byte is in exactly
/// one.
enum class PieceKind : std::uint8_t {
  space,         ///< blanks and tabs
  word,          ///< address and number: G1, X-1.5, N10, A3=0.1
  assignment,    ///< #1=5, #<depth>=[2*3]; R1=5 of siemens
  statement,     ///< siemens: TRAORI, MSG("text"), CTOL=0.02
  flow,          ///< o100 while [..], IF [..] GOTO 5: what runs next; `detail` is its FlowKind
  comment,       ///< ( ... ) or ; to the end of the line
  block_delete,  ///< /
  percent,       ///< %
  line_end,      ///< LF, CR LF or CR
  construct,     ///< something of another dialect or a later issue: O-word, polar word ...
  trailer        ///< text after the second %, which controllers ignore
};

/// How the value of a word stands in the text.
enum class WordForm : std::uint8_t {
  number,       ///< Piece::value
  expression,   ///< to be computed from the text when the block runs
  absolute,     ///< siemens X=AC(..): the same, whatever G90 or G91 says
  incremental,  ///< siemens X=IC(..)
  name,         ///< siemens T="DRILL"
  shortest,     ///< siemens C=DC(..): absolute, the shorter way round
  upwards,      ///< siemens C=ACP(..)
  downwards     ///< siemens C=ACN(..)
};

/// Addresses of more than one letter, behind Z in a word's `letter`.
inline constexpr char kAxisVectorX = 'Z' + 1;       ///< A3
inline constexpr char kAxisVectorY = 'Z' + 2;       ///< B3
inline constexpr char kAxisVectorZ = 'Z' + 3;       ///< C3
inline constexpr char kCircleRadius = 'Z' + 4;      ///< CR
inline constexpr char kCircleTurns = 'Z' + 5;       ///< TURN
inline constexpr char kPlaneAngle = 'Z' + 6;        ///< RPL
inline constexpr char kThroughX = 'Z' + 7;          ///< I1
inline constexpr char kThroughY = 'Z' + 8;          ///< J1
inline constexpr char kThroughZ = 'Z' + 9;          ///< K1
inline constexpr char kArcAngle = 'Z' + 10;         ///< AR
inline constexpr char kPolarAngle = 'Z' + 11;       ///< AP
inline constexpr char kPolarRadius = 'Z' + 12;      ///< RP
inline constexpr char kAxisAngleA = 'Z' + 13;       ///< A2
inline constexpr char kAxisAngleB = 'Z' + 14;       ///< B2
inline constexpr char kAxisAngleC = 'Z' + 15;       ///< C2
inline constexpr char kParameterLength = 'Z' + 16;  ///< PL

struct Piece {
  PieceKind kind = PieceKind::space;
  char letter = 0;          ///< upper case, kind word
  std::uint8_t detail = 0;  ///< kind word: WordForm; statement: SiemensWord; flow: FlowKind
  std::uint32_t begin = 0;  ///< byte offset into Program::text
  std::uint32_t length = 0;
  double value = 0.0;  ///< kind word
};

/// One line of text.
struct Block {
  std::uint32_t first_piece = 0;
  std::uint32_t piece_count = 0;
};

/// A fault of text behind the end of the program. Controllers read such text only when a
/// subroutine stands there that is called.
struct LateFault {
  std::uint32_t line = 0;
  std::uint32_t column = 0;
  const char* code = "";
  std::string text;
};

/// NC text as a tree: one block a line, pieces with spans. Line = number of the block + 1; a
/// piece's column is its offset from the block's first piece + 1.
///
/// `blocks` and `pieces` are those of the whole text, or of a window of it (program_stream.h); the
/// other members are always of the whole text.
struct Program {
  InputDialect dialect = InputDialect::linuxcnc;
  std::string file_name;
  std::string text;
  std::vector<Block> blocks;
  std::vector<Piece, LargePageAllocator<Piece>> pieces;
  std::size_t first_block = 0;           ///< number of the first one in `blocks`
  std::size_t block_count = 0;           ///< of the text: its lines
  bool has_flow = false;                 ///< some piece is of kind flow
  bool has_calls = false;                ///< M97 to M99, G65, or a G or M word that is computed
  std::uint32_t first_fault = 0;         ///< line of the first fault before the end; 0: none
  std::uint32_t end_block = 0xffffffff;  ///< first block behind M2 or M30
  std::vector<LateFault> late_faults;    ///< at most kLateFaults, in order of the text
  static constexpr std::size_t kLateFaults = 100;

  /// @pre the block stands in `blocks`
  const Block& block(std::size_t number) const { return blocks[number - first_block]; }
  bool holds(std::size_t number) const { return number - first_block < blocks.size(); }
  bool is_whole() const { return blocks.size() == block_count; }
  /// Its run may go to any block of the text.
  bool jumps() const { return has_flow || has_calls; }
};

/// The text of the program, put together from its pieces: equal to the text that was parsed, byte
/// for byte, whether or not it has errors. Of a window: the text of its blocks.
std::string print(const Program& program);

}  // namespace smoothpost::nc
