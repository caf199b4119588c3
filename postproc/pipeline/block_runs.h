#pragma once

#include <cstddef>
#include <functional>
#include <vector>

#include "machines/dialects/dialect.h"
#include "postproc/pipeline/feed_schedule.h"
#include "postproc/pipeline/reference_path.h"

// Runs of straight blocks of a scheduled path that one block of another shape may take the place
// of.
namespace smoothpost {

struct CurveInput {
  const ReferencePath& reference;
  const FeedSchedule& schedule;
  const MachineDefinition& machine;
  const ScrewChain& chain;  ///< tool length 0, part placed
};

struct CurveReport {
  std::size_t before = 0, after = 0;  ///< moves of scheduled stretches
  std::size_t curves = 0;             ///< of those behind, the ones that took the place of several
};

/// A program's moves on the stretches that they follow. Both are kept by reference.
class BlockRuns {
 public:
  /// Where a move stands on its stretch.
  struct Place {
    bool on = false;              ///< both ends are on it, and it moves on
    double from = 0.0, to = 0.0;  ///< s
  };

  BlockRuns(MachineProgram& program, const CurveInput& input);

  /// Replaces the longest runs that hold, from the front: behind `first` as many moves as
  /// may_follow() and holds(first, end) allow, and is_worth(first, end) does not refuse. What comes
  /// out is joined(first, end), whose shares and duration are set here. A move may follow on the
  /// same stretch with the same joints and tool when no action (event, label, comment, dwell)
  /// stands between and nothing changes there that is of the input's points: beam, tool, programmed
  /// feed, events.
  struct Rules {
    std::function<bool(std::size_t, std::size_t)> holds;
    std::function<MachineMove(std::size_t, std::size_t)> joined;
    std::function<bool(std::size_t, std::size_t)> is_worth = {};  ///< empty: every run is
  };
  CurveReport replace(const Rules& rules);

  const std::vector<Place>& places() const { return places_; }
  const ScheduledStretch& stretch(std::size_t i) const;
  /// s, of the moves first to end − 1 together.
  double duration(std::size_t first, std::size_t end) const;
  /// τ of a run's own parameter that is paired with the end of each of its moves, as the
  /// certificate does it: by share inside a segment, by length of the tip over several. Empty: a
  /// run over several segments on which the tip stands.
  std::vector<double> pairing(std::size_t first, std::size_t end) const;
  /// A run's motion at an even pace passes the end of each move, the τ of which `even` has, at most
  /// kShortBlock earlier or later than the moves do.
  bool keeps_time(std::size_t first, std::size_t end, const std::vector<double>& even) const;
  /// Tip and tool axis at `joints` are as near to those at `wanted` as 0.8 of the tolerances' chord
  /// share allows, with the tool of move i.
  bool is_near(std::size_t i, const JointVector& joints, const JointVector& wanted) const;

 private:
  void find_places();
  double s_at(std::size_t i, double time) const;
  bool is_on(std::size_t i, double s, const JointVector& q) const;
  bool may_follow(std::size_t next) const;
  bool same_state(std::size_t a, std::size_t b) const;
  std::size_t longest_run(std::size_t first, const Rules& rules) const;
  double way(std::size_t i) const;

  MachineProgram& program_;
  const CurveInput& in_;
  double tip_ = 0.0, axis_ = 0.0;
  std::vector<std::size_t> event_points_;  ///< ascending, as events are
  std::vector<std::size_t> action_moves_;  ///< ascending, as actions are
  std::vector<Place> places_;
};

}  // namespace smoothpost
