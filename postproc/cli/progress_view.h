#pragma once

#include <chrono>
#include <string>

namespace smoothpost::cli {

enum class Bar { none, terminal, filter };

/// What `--progress auto|bar|filter|none` means here: auto is a bar on a terminal, else nothing.
Bar bar_of(const std::string& option);

/// Shows on standard error how far a run is.
///
/// terminal: one line, drawn anew at most ten times a second: the stage, a bar of its share,
/// percent a second, and the time left in it at that rate. `clear` wipes it. filter:
/// `FILTER_PROGRESS=n`, n from 0 to 100 for the whole run, never less than before, at most one line
/// a second: what LinuxCNC's filter programs say.
class ProgressView {
 public:
  explicit ProgressView(Bar bar) : bar_(bar) {}

  void show(const std::string& stage, double share);
  void clear();

 private:
  using Clock = std::chrono::steady_clock;

  void draw(double share, Clock::time_point now);

  Bar bar_;
  std::string stage_;
  Clock::time_point stage_began_;
  double share_at_begin_ = 0.0;
  Clock::time_point shown_;
  bool drawn_ = false;
  int percent_ = -1;
};

}  // namespace smoothpost::cli
