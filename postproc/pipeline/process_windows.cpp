#include "postproc/pipeline/process_windows.h"

#include <algorithm>
#include <map>
#include <utility>

#include "kernels/core/contract.h"

namespace smoothpost {

namespace {

/// The numbers each of whose parts one of the runs first..last has.
std::vector<bool> possible(const std::vector<std::uint32_t>& runs, std::size_t first,
                           std::size_t last, const std::vector<std::vector<std::uint32_t>>& parts) {
  const std::size_t count = std::max(
      parts.size(), static_cast<std::size_t>(*std::max_element(runs.begin(), runs.end())) + 1);
  std::vector<bool> open(count, true);
  for (std::uint32_t number = 0; number < count; ++number)
    for (std::size_t part = 0; part < (parts.empty() ? 1 : parts.front().size()); ++part) {
      bool found = false;
      for (std::size_t run = first; run <= last && !found; ++run)
        found = parts.empty() ? runs[run] == number : parts[runs[run]][part] == parts[number][part];
      open[number] = open[number] && found;
    }
  return open;
}

}  // namespace

ProcessWindows process_windows(const ProcessAlong& along, double tolerance) {
  const std::size_t n = along.way.size();
  require(n > 0 && along.process.size() == n, "places with a process");
  std::vector<std::uint32_t> runs = {along.before};
  std::vector<std::size_t> run_of;
  for (std::size_t i = 0; i < n; ++i) {
    if (i == 0 || along.process[i] != along.process[i - 1]) runs.push_back(along.process[i]);
    run_of.push_back(runs.size() - 1);
  }
  runs.push_back(along.behind);
  ProcessWindows out;
  std::map<std::pair<std::size_t, std::size_t>, std::int32_t> known;
  std::size_t back = 0, ahead = 0;  // the first and the last place within the tolerance
  for (std::size_t i = 0; i < n; ++i) {
    while (along.way[i] - along.way[back] > tolerance) ++back;
    while (ahead + 1 < n && along.way[ahead + 1] - along.way[i] <= tolerance) ++ahead;
    const std::size_t first = back == 0 ? 0 : run_of[back - 1];
    const std::size_t last = ahead + 1 == n ? runs.size() - 1 : run_of[ahead + 1];
    if (first == last) {
      out.of.push_back(-1);
      continue;
    }
    const auto [at, made] =
        known.try_emplace({first, last}, static_cast<std::int32_t>(out.windows.size()));
    if (made) out.windows.push_back(possible(runs, first, last, along.parts));
    out.of.push_back(at->second);
  }
  return out;
}

}  // namespace smoothpost
