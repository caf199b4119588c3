#pragma once

#include <cstddef>
#include <functional>
#include <memory>
#include <string>

#include "formats/nc/diagnostic_log.h"
#include "formats/nc/program.h"
#include "kernels/core/result.h"

namespace smoothpost::nc {

class TreeBuilder;

/// NC text of which a window of blocks is parsed at a time, so that its pieces need not be in
/// memory all at once: a program without flow takes its text and a window of pieces.
///
/// The text is parsed twice. The first time, by the constructor, every window is looked at and
/// dropped: that gives the diagnostics and what Program says of the whole text. Then next() goes
/// through the windows again. The window is the whole text at once when the run may go from any
/// block to any other (Program::jumps()), and when one window holds it.
class ProgramStream {
 public:
  using Look = std::function<void(const Program&)>;
  static constexpr std::size_t kWindow = 2048;

  /// Parses the text as parse() does.
  /// @param window  blocks that are in memory at a time, at least 1; fewer when they are long
  /// @param look    called with every window in order of the text; one with first_block 0 after
  ///                others begins anew
  ProgramStream(std::string text, std::string file_name, InputDialect dialect,
                std::size_t window = kWindow, const Look& look = {});
  ~ProgramStream();
  ProgramStream(const ProgramStream&) = delete;
  ProgramStream& operator=(const ProgramStream&) = delete;

  /// Of the text, as parse() gives them.
  const Diagnostics& diagnostics() const { return diagnostics_; }
  /// The window; the same object at all times.
  const Program& program() const { return program_; }
  /// Back to the first window.
  void rewind();
  /// On to the next window. False: there is none, and the last one stays.
  bool next();

 private:
  void survey(DiagnosticLog& log, const Look& look);
  void clear_window();

  Program program_;
  std::size_t window_;
  Diagnostics diagnostics_;
  DiagnosticLog unused_;  ///< the second reading tells nothing
  std::unique_ptr<TreeBuilder> builder_;
};

}  // namespace smoothpost::nc
