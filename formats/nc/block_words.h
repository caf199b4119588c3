#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>

#include "formats/nc/codes.h"
#include "formats/nc/diagnostic_log.h"
#include "formats/nc/expression.h"
#include "formats/nc/program.h"
#include "formats/nc/siemens_words.h"

namespace smoothpost::nc {

struct InterpreterSettings;
class ParameterStore;
struct CallScope;

/// A set of word letters: bit 0 is A, bit 25 is Z, then the addresses of more than one letter.
using LetterMask = std::uint64_t;

constexpr int letter_index(char letter) { return letter - 'A'; }
constexpr LetterMask letter_bit(char letter) { return LetterMask{1} << letter_index(letter); }

inline constexpr int kAddresses = 42;

/// The components of the tool axis.
inline constexpr LetterMask kVectorMask =
    letter_bit(kAxisVectorX) | letter_bit(kAxisVectorY) | letter_bit(kAxisVectorZ);

/// Letters of the axis words in the bits of LetterMask.
inline constexpr LetterMask kAxisLetterMask = letter_bit('X') | letter_bit('Y') | letter_bit('Z') |
                                              letter_bit('A') | letter_bit('B') | letter_bit('C') |
                                              letter_bit('U') | letter_bit('V') | letter_bit('W');

/// The words of one block, by letter, by modal group and as a list of M words.
struct BlockWords {
  static constexpr int kMaxM = 4;

  std::uint32_t line = 0;        ///< of the text that the block stands in
  std::uint32_t input_line = 0;  ///< the same, but for the file of a subroutine: that of its call
  LetterMask letters = 0;        ///< all but G, M, N, O
  LetterMask absolute = 0;       ///< words with AC()
  LetterMask incremental = 0;    ///< words with IC()
  std::uint32_t senses = 0;      ///< WordForm of A, B, C with DC(), ACP(), ACN(), 8 bits each
  std::array<double, kAddresses> value;
  std::array<std::uint32_t, kAddresses> piece;
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
  bool words = false;                     ///< any word at all
  std::uint32_t statements = 0;           ///< bit i: the block has the SiemensWord i
  std::uint32_t flow_piece = kNone;       ///< the block is a line of program flow
  std::uint32_t statement_piece = kNone;  ///< the last one but those without effect

  static constexpr std::uint32_t kNone = 0xffffffff;

  bool has(char letter) const { return (letters & letter_bit(letter)) != 0; }
  double operator[](char letter) const {
    return value[static_cast<std::size_t>(letter_index(letter))];
  }
  bool says(SiemensWord word) const {
    return ((statements >> static_cast<unsigned>(word)) & 1u) != 0;
  }
  GCode code(GGroup group) const { return g[static_cast<std::size_t>(group)]; }
  bool has_m(int number) const {
    for (int i = 0; i < m_count; ++i) {
      if (m[static_cast<std::size_t>(i)] == number) return true;
    }
    return false;
  }
};

/// Computes the words and assignments whose values are expressions.
class WordValues {
 public:
  virtual ~WordValues() = default;
  /// The value of a word from the whole text of its piece.
  virtual Evaluated word(std::string_view text, WordForm form) = 0;
  /// An assignment or declaration; it takes effect by finish_block() in LinuxCNC, at once in
  /// Sinumerik programs.
  virtual Evaluated assign(std::string_view text) = 0;
  /// The block was read; `good`: without a fault.
  virtual void finish_block(bool good) = 0;
  /// G20 is active.
  virtual bool inch() const = 0;
  /// X words are diameters.
  virtual bool diameter() const { return false; }
  /// A canned cycle is active.
  virtual bool in_cycle() const { return false; }
  /// The value at the start of `text`, of a line of program flow.
  virtual Evaluated value(std::string_view) { return {}; }
  /// The parameters; nullptr: those of Sinumerik programs.
  virtual ParameterStore* store() { return nullptr; }
  /// A subprogram begins, and ends.
  virtual void enter_call(const CallScope& scope) = 0;
  virtual void leave_call() = 0;
  /// siemens: what the variable holds is not certain until it is assigned again.
  virtual void forget(const std::string&) {}
  /// siemens: the text of MSG( ); nothing: it is no text.
  virtual std::optional<std::string> text(std::string_view) { return std::nullopt; }
};

/// Sorts the pieces of blocks into BlockWords and refuses what no block may hold: unknown and
/// unread G codes, two words of one modal group, a letter twice, more than four M words.
/// Values that are expressions come from `values`, which also takes the program's assignments.
class BlockReader {
 public:
  BlockReader(const Program& program, const InterpreterSettings& settings, WordValues& values,
              DiagnosticLog& log)
      : program_(&program),
        settings_(settings),
        values_(values),
        log_(log),
        checks_points_(program.dialect == InputDialect::fanuc ||
                       program.dialect == InputDialect::haas) {}

  /// Blocks are those of `program` from now on. `input_line` 0: their lines are those of the input;
  /// else all of them count as that line of it.
  void select(const Program& program, std::uint32_t input_line) {
    program_ = &program;
    input_line_ = input_line;
  }
  const Program& program() const { return *program_; }

  /// @pre program.holds(index). Valid until the next call.
  const BlockWords& read(std::size_t index);

  InputDialect dialect() const { return program_->dialect; }
  /// Where a piece stands in the input: in the file of a subroutine the line of its call.
  TextPlace input_place(const BlockWords& block, std::uint32_t piece) const {
    return input_line_ == 0 ? place(block, piece) : TextPlace{input_line_, 1};
  }
  TextPlace place(const BlockWords& block, std::uint32_t piece) const;
  /// The word as written, upper case, without blanks.
  std::string text(std::uint32_t piece) const;
  /// The text of a piece, as written.
  std::string_view raw(std::uint32_t piece) const {
    const Piece& p = program_->pieces[piece];
    return std::string_view(program_->text).substr(p.begin, p.length);
  }
  /// Whether a word of the Fanuc family has a decimal point.
  bool has_point(std::uint32_t piece) const {
    return raw(piece).find('.') != std::string_view::npos;
  }

 private:
  void add_construct(std::uint32_t index);
  bool tell_late_faults();
  void add_word(const Piece& piece, std::uint32_t index);
  void add_value(const Piece& piece, std::uint32_t index);
  void put(const Piece& piece, std::uint32_t index, double value);
  void add_statement(const Piece& piece, std::uint32_t index);
  void assign(std::uint32_t index);
  double in_increments(const Piece& piece, std::uint32_t index);
  bool is_g_allowed(const GCodeInfo& info, GCode code, std::uint32_t index);
  void add_g(double value, std::uint32_t index);
  void add_m(double value, std::uint32_t index);
  void halve_diameter();
  void refuse(const char* code, std::string text, std::uint32_t piece);

  const Program* program_;
  std::uint32_t input_line_ = 0;
  const InterpreterSettings& settings_;
  WordValues& values_;
  DiagnosticLog& log_;
  const bool checks_points_;
  BlockWords block_;
  bool construct_told_ = false;
  LetterMask points_told_ = 0;
};

}  // namespace smoothpost::nc
