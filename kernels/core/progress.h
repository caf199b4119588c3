#pragma once

#include <functional>

namespace smoothpost {

/// How a stage tells how far it is and learns that the user wants to stop. `report(stage, share)`
/// gets the stage's name and its share done in [0, 1]; it returns false to cancel. Called from one
/// thread.
struct Progress {
  std::function<bool(const char* stage, double share)> report;

  /// Returns false when the work is to be cancelled.
  bool operator()(const char* stage, double share) const { return !report || report(stage, share); }
};

}  // namespace smoothpost
