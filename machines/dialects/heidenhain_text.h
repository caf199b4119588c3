#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "machines/dialects/program_reading.h"

// Conversational programs as we write them:
//   file = "0 BEGIN PGM" name unit {number block} number "END PGM" name unit
//   block = ";" text | "* -" text | ("L" | "LN") {word} | any other statement
//   word = address sign number | "F" number | "FMAX" | "R0" | "M" number
namespace smoothpost::heidenhain {

struct Word {
  std::string address;  ///< X, TX, F ...
  double value = 0.0;
};

struct Block {
  TextPlace at;
  std::string text;            ///< without the number
  bool is_line = false;        ///< L or LN
  bool is_vector = false;      ///< LN
  bool rapid = false;          ///< FMAX
  bool machine_words = false;  ///< M91
  std::vector<Word> words;     ///< of L and LN: coordinates, components and F

  std::optional<double> find(std::string_view address) const;
};

struct Parsed {
  std::vector<Block> blocks;  ///< without comments, structure, BEGIN and END
  bool inch = false;
  std::uint32_t line_count = 0;
  std::uint32_t end_line = 0;
  Diagnostics diagnostics;
};

/// Splits a program. NC343: numbers that are not 0, 1, 2 ..., BEGIN and END PGM that do not fit, a
/// character outside printable ASCII, a line too long, an L or LN with a word that is malformed, a
/// coordinate without sign or beyond 99999.9999, a word twice, F and FMAX together.
/// Cost: linear.
Parsed parse(std::string_view text, const std::string& file);

}  // namespace smoothpost::heidenhain
