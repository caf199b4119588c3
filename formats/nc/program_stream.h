#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "formats/nc/diagnostic_log.h"
#include "formats/nc/flow_index.h"
#include "formats/nc/program.h"
#include "kernels/core/result.h"

namespace smoothpost::nc {

class TreeBuilder;

/// NC text of which a window of blocks is parsed at a time, while the blocks before it run, so that
/// its pieces need not be in memory all at once: a program without flow takes its text and a window
/// of pieces.
///
/// When the run may go from any block to any other (Program::jumps()) the text is read to its end
/// first, which gives its flow; the windows are smaller then, some of them are kept, and others are
/// read again when the run comes to them. Where a window of a run that has begun shows that first,
/// the run begins again: what was told and called before is void.
class ProgramStream {
 public:
  static constexpr std::size_t kWindow = 2048;
  static constexpr std::size_t kKept = 256;
  struct Hooks {
    /// Called once with every window in order of the text; one with first_block 0 after others
    /// begins anew.
    std::function<void(const Program&)> look;
    /// The run begins again: what the sink got is void.
    std::function<void()> restart;
  };

  /// Parses the first window, or all of them one after the other, as parse() does.
  /// @param window  blocks that are in memory at a time, at least 1; fewer when they are long, and
  ///                an eighth when the program jumps
  /// @param kept    windows of a program that jumps that are in memory beside it
  ProgramStream(std::string text, std::string file_name, InputDialect dialect, Hooks hooks,
                std::size_t window = kWindow, std::size_t kept = kKept);
  ~ProgramStream();
  ProgramStream(const ProgramStream&) = delete;
  ProgramStream& operator=(const ProgramStream&) = delete;

  /// The window; the same object at all times. Its faults and has_flow, has_calls, end_block are
  /// those of the text so far, block_count is that of the whole text.
  const Program& program() const { return program_; }
  /// On to the next window. False: there is none, or the program turned out to jump.
  bool next();
  /// The program is one that jumps, and its text has been read to its end.
  bool jumps() const { return !parts_.empty(); }
  /// The window becomes one that holds the block. @pre jumps(), block < block_count
  void go_to(std::size_t block);
  /// The flow of the program. @pre jumps(). Once for each run.
  FlowIndex take_flow();
  /// Of the whole text, as parse() gives them. @pre next() has come to the end
  const Diagnostics& diagnostics() const;
  /// Whether the program turned out to jump since the last call, which is then told by
  /// Hooks::restart.
  bool begins_again();

 private:
  using Pieces = decltype(Program::pieces);
  /// Where a window of a program that jumps begins.
  struct Part {
    std::size_t first_block = 0;
    std::unique_ptr<TreeBuilder> builder;
  };
  /// A window that is kept.
  struct Kept {
    std::size_t part = 0;
    std::uint64_t used = 0;  ///< the larger, the later
    std::vector<Block> blocks;
    Pieces pieces;
  };

  void show();
  void read_parts();
  void show_part(std::size_t part);
  void keep();

  Program program_;
  Hooks hooks_;
  std::size_t window_, most_kept_;
  std::size_t lines_ = 0;  ///< of the text; 0: one window holds it
  DiagnosticLog log_;
  std::unique_ptr<TreeBuilder> builder_;
  Diagnostics diagnostics_;
  bool ended_ = false;
  bool begins_again_ = false;
  std::vector<Part> parts_;
  std::vector<Kept> kept_;
  std::size_t part_ = 0;  ///< the window
  std::uint64_t shown_ = 0;
  std::optional<FlowIndex> flow_;
};

}  // namespace smoothpost::nc
