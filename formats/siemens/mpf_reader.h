#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "kernels/core/diagnostic.h"

// SINUMERIK 840D part programs (.mpf): blocks and words, and the rules that hold whatever the words
// mean. Only what we write is read; the input reader of the pipeline is formats/nc.
namespace smoothpost::siemens {

/// X10.5, G54, A3=0.5 (address "A3"), TRAORI (no value). Addresses in upper case.
/// PO[X]=(10,0.5,-2) and X=PO(10,0.5,-2) are address "X", value 10 and higher {0.5, -2}.
struct MpfWord {
  std::string address;
  std::optional<double> value;
  bool polynomial = false;
  std::vector<double> higher;  ///< of a polynomial: coefficients of the second power on
};

struct MpfBlock {
  std::uint32_t line = 0;
  std::uint32_t column = 0;
  std::string label;      ///< of "NAME:", upper case
  std::string text;       ///< without N, label and comment
  bool is_words = false;  ///< the text is nothing but words
  std::vector<MpfWord> words;

  const MpfWord* find(std::string_view address) const;
  /// A word without value: TRAORI.
  bool has(std::string_view keyword) const;
  /// G or M with that number.
  bool has(char letter, double value) const;
};

struct MpfProgram {
  std::vector<MpfBlock> blocks;  ///< without empty ones
  std::uint32_t line_count = 0;
  std::uint32_t end_line = 0;  ///< of M30, M2 or M17
};

struct ParsedMpf {
  MpfProgram program;
  Diagnostics diagnostics;
};

/// Splits a program into blocks and words and checks: N words rise (NC325); words, quotes, brackets
/// and jump labels are well formed, no address twice and at most one of G0 to G3 in a block
/// (NC326); G0 to G3 and POLY are one group; PO[..]=(..) has one to three numbers, ..=PO(..) one to
/// five, both and PL= only beside POLY, which has PL= from 0.0001 to 99999.9999 and a polynomial at
/// least (NC326); A3= B3= C3= only while TRAORI is on, never all 0, and TRAFOOF before the end
/// (NC327); the program ends with M30, M2 or M17 and nothing stands behind it (NC325). All faults
/// are collected.
///
/// Guarantees (tests): values as written; refuses malformed programs.   Cost: linear in the text.
ParsedMpf parse_mpf(std::string_view text, const std::string& file_name);

}  // namespace smoothpost::siemens
