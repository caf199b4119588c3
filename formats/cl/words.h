#pragma once

#include <cstdint>
#include <string_view>

namespace smoothpost::cl {

/// What a major word means to the reader.
enum class Word : std::uint8_t {
  unknown,
  // motion
  go_to,
  from,
  godlta,
  rapid,
  fedrat,
  circle,
  indirv,
  tlon,
  cycle,
  multax,
  tlaxis,
  // coordinates
  units,
  msys,
  csys,
  trntyp,
  // process
  spindl,
  loadtl,
  load,
  select,
  toolno,
  coolnt,
  cutcom,
  delay,
  stop,
  opstop,
  // text and structure
  text,         ///< kept as a comment without its word: PPRINT, REMARK
  description,  ///< kept as a comment with its word: PARTNO, CUTTER, TLDATA ...
  insert,
  no_effect,
  end_of_path,
  end,
  fini,
  refused  ///< known, and not read: `reason` says why
};

/// How the rest of the statement is written.
enum class Rest : std::uint8_t {
  items,  ///< values between commas
  line,   ///< any text to the end of the line; $ has no meaning in it
  free    ///< any text, with continuation
};

struct WordInfo {
  std::string_view name;  ///< upper case, blanks left out
  Word word = Word::unknown;
  Rest rest = Rest::items;
  std::string_view reason;  ///< of a refused word: what it would do, and what to do about it
};

/// The row of a major word in upper case, or nullptr.
const WordInfo* find_word(std::string_view upper);

/// Upper case of a basic Latin letter, anything else as it is.
constexpr char upper(char c) { return c >= 'a' && c <= 'z' ? static_cast<char>(c - 32) : c; }

/// Whether two words are the same in any case. `upper_case` is in upper case.
bool same_word(std::string_view text, std::string_view upper_case);

}  // namespace smoothpost::cl
