#pragma once

#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "kernels/core/diagnostic.h"
#include "machines/dialects/program_reading.h"

// G-code as our dialects write it: one block a line, words of one letter and a decimal number.
//   line = [N digits] {word | "(" text ")"} [";" text]    word = letter number, blanks may be
//   between
namespace smoothpost::gcode {

struct Word {
  char letter = 0;  ///< upper case
  double value = 0.0;
};

struct Block {
  TextPlace at;
  std::string raw;   ///< without N, comments as they stand
  std::string text;  ///< without N and comments
  bool is_words = false;
  std::vector<Word> words;

  const Word* find(char letter) const;
  bool has(char letter, double value) const;
};

/// How the blocks of one controller look.
struct Syntax {
  std::size_t longest = 250;  ///< characters of a line
  bool semicolon = false;     ///< ; starts a comment
  bool rising = false;        ///< N words have to rise
};

struct Parsed {
  std::vector<Block> blocks;  ///< without empty lines; "%" is a block without words
  std::uint32_t line_count = 0;
  Diagnostics diagnostics;
};

/// Splits a program. NC340: a line too long, a character outside printable ASCII, a comment that is
/// not closed or holds another one, N that does not rise, a letter twice in a block (G and M may
/// be), two of G0 to G3. What is not all words is left to the caller, as `text`.
/// Cost: linear in the text.
Parsed parse(std::string_view text, const std::string& file, const Syntax& syntax);

/// Prints the words of axes and leaves out those that say what the last one with their address did.
class AxisWords {
 public:
  struct Style {
    bool point = false;  ///< a number always has its decimal point
    bool plus = false;   ///< a number always has its sign
  };
  AxisWords(const MachineDefinition& machine, Style style);

  /// `value` with at most `decimals` decimals.
  std::string number(double value, int decimals) const;
  /// A length in mm, in the program's unit with its digits.
  std::string length(double value) const;
  /// An angle in rad, in degrees with its digits.
  std::string angle(double value) const;
  /// The position of a joint behind its letter.
  std::string joint(int j, double value) const;

  /// Appends a blank and the word, unless it is the last one of `address`.
  void put(std::string& words, const std::string& address, const std::string& word);
  /// Words of the joints in `mask` that changed, at least one. `shift` (mm) is taken off X Y Z.
  std::string joints(JointMask mask, const JointVector& to, const Vec3& shift = Vec3::Zero());
  void forget() { printed_.clear(); }
  double length_scale() const { return length_scale_; }

 private:
  const MachineDefinition& machine_;
  Style style_;
  double length_scale_ = 1.0;
  std::map<std::string, std::string> printed_;
};

}  // namespace smoothpost::gcode
