#pragma once

#include <cstddef>
#include <functional>
#include <memory>
#include <string>
#include <string_view>

#include "formats/nc/diagnostic_log.h"
#include "formats/nc/program.h"
#include "kernels/core/result.h"

namespace smoothpost::nc {

class TreeBuilder;

/// NC text of which a window of blocks is parsed at a time, while the blocks before it run, so that
/// its pieces need not be in memory all at once: a program without flow takes its text and a window
/// of pieces.
///
/// The window is the whole text when the run may go from any block to any other
/// (Program::jumps()). Where a window shows that first, the whole text is parsed instead and the
/// run begins again: what was told and called before is void.
class ProgramStream {
 public:
  static constexpr std::size_t kWindow = 2048;
  struct Hooks {
    /// Called with every window in order of the text; one with first_block 0 after others begins
    /// anew.
    std::function<void(const Program&)> look;
    /// The run begins again: what the sink got is void.
    std::function<void()> restart;
  };

  /// Parses the first window, as parse() does.
  /// @param window  blocks that are in memory at a time, at least 1; fewer when they are long
  ProgramStream(std::string text, std::string file_name, InputDialect dialect, Hooks hooks,
                std::size_t window = kWindow);
  ~ProgramStream();
  ProgramStream(const ProgramStream&) = delete;
  ProgramStream& operator=(const ProgramStream&) = delete;

  /// The window; the same object at all times. Its faults and has_flow, has_calls, end_block are
  /// those of the text so far, block_count is that of the whole text.
  const Program& program() const { return program_; }
  /// On to the next window. False: there is none, or the window has become the whole text.
  bool next();
  /// Of the whole text, as parse() gives them. @pre next() has come to the end
  const Diagnostics& diagnostics() const;
  /// Whether the window has become the whole text since the last call, which is then told by
  /// Hooks::restart.
  bool begins_again();

 private:
  void show();

  Program program_;
  Hooks hooks_;
  std::size_t window_;
  std::size_t lines_ = 0;  ///< of the text; 0: one window holds it
  DiagnosticLog log_;
  std::unique_ptr<TreeBuilder> builder_;
  Diagnostics diagnostics_;
  bool ended_ = false;
  bool begins_again_ = false;
};

}  // namespace smoothpost::nc
