#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "formats/nc/diagnostic_log.h"

namespace smoothpost::conversational {

/// One block: its text without block number, skip mark and comments; lines joined by ~ are one.
struct Statement {
  std::string_view text;     ///< no blanks at either end
  std::string_view comment;  ///< behind the first ; or the text of a structure line * -
};

/// The blocks of a program. Lines end by LF or CR LF, by CR where the text has no LF. Empty lines
/// are none. A line goes on in the next one when it ends in ~, unless it is a comment alone.
class Source {
 public:
  /// @pre text.size() < 2^32; `text` outlives the source.   Cost: linear; 8 bytes a block.
  explicit Source(std::string_view text);

  std::size_t size() const { return starts_.size(); }
  std::uint32_t lines() const { return lines_; }

  /// Valid until the next call.   @pre index < size()
  Statement read(std::size_t index);
  /// How many bytes of the file a block takes.
  std::size_t length(std::size_t index) const;
  /// Where a byte of the text of the block that was read last stands in the file.
  nc::TextPlace place(std::size_t offset) const;

 private:
  struct Start {
    std::uint32_t begin = 0;
    std::uint32_t line = 0;
  };
  struct Part {
    std::size_t offset = 0;  ///< in the block's text
    nc::TextPlace place;
  };

  void add_line(std::string_view line, std::string_view& comment, nc::TextPlace place);

  std::string_view text_;
  char line_end_;
  std::vector<Start> starts_;
  std::uint32_t lines_ = 0;
  std::string joined_;
  std::vector<Part> parts_;
};

}  // namespace smoothpost::conversational
