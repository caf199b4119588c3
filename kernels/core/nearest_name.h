#pragma once

#include <algorithm>
#include <string>
#include <string_view>
#include <vector>

namespace smoothpost {

/// The one of `names` that is fewest edits (a letter put in, left out or exchanged) away from
/// `name`, the first of equals; empty when none is near: within a third of the letters, at least 2.
/// Cost: O(letters · letters) for each name; of `name` the first 64 bytes count.
inline std::string nearest_name(std::string_view name, const std::vector<std::string>& names) {
  name = name.substr(0, 64);
  std::string best;
  std::size_t least = std::max<std::size_t>(2, name.size() / 3) + 1;
  std::vector<std::size_t> row;
  for (const std::string& candidate : names) {
    row.resize(candidate.size() + 1);
    for (std::size_t j = 0; j < row.size(); ++j) row[j] = j;
    for (std::size_t i = 1; i <= name.size(); ++i) {
      std::size_t diagonal = row[0];
      row[0] = i;
      for (std::size_t j = 1; j < row.size(); ++j) {
        const std::size_t above = row[j];
        const std::size_t change = diagonal + (name[i - 1] == candidate[j - 1] ? 0 : 1);
        row[j] = std::min({change, above + 1, row[j - 1] + 1});
        diagonal = above;
      }
    }
    if (row.back() >= least) continue;
    least = row.back();
    best = candidate;
  }
  return best;
}

/// ", did you mean X?" of nearest_name(), else of the first name that begins with `name` (3 letters
/// at least), or nothing.
inline std::string did_you_mean(std::string_view name, const std::vector<std::string>& names) {
  std::string guess = nearest_name(name, names);
  for (const std::string& candidate : names)
    if (guess.empty() && name.size() >= 3 && candidate.substr(0, name.size()) == name)
      guess = candidate;
  return guess.empty() ? std::string() : ", did you mean " + guess + "?";
}

}  // namespace smoothpost
