#include "postproc/pipeline/contour_line.h"

#include <algorithm>

namespace smoothpost {

ContourLine::ContourLine(const SliceContour& contour) : points_(contour.points) {
  if (contour.closed) points_.push_back(points_.front());
  length_.push_back(0.0);
  for (std::size_t i = 1; i < points_.size(); ++i)
    length_.push_back(length_.back() + (points_[i] - points_[i - 1]).norm());
}

std::size_t ContourLine::segment(double s) const {
  const auto next = std::upper_bound(length_.begin(), length_.end(), s);
  return static_cast<std::size_t>(std::clamp<std::ptrdiff_t>(
      next - length_.begin() - 1, 0, static_cast<std::ptrdiff_t>(points_.size()) - 2));
}

Vec3 ContourLine::at(double s) const {
  const std::size_t i = segment(s);
  const double h = length_[i + 1] - length_[i];
  const double t = h > 0.0 ? std::clamp((s - length_[i]) / h, 0.0, 1.0) : 0.0;
  return points_[i] + t * (points_[i + 1] - points_[i]);
}

Vec3 ContourLine::direction(double s) const {
  const std::size_t i = segment(s);
  return (points_[i + 1] - points_[i]).normalized();
}

double ContourLine::middle_of_longest() const {
  std::size_t longest = 1;
  for (std::size_t i = 2; i < length_.size(); ++i)
    if (length_[i] - length_[i - 1] > length_[longest] - length_[longest - 1] + 1e-6) longest = i;
  return 0.5 * (length_[longest - 1] + length_[longest]);
}

std::optional<std::pair<Vec3, double>> ContourLine::corner(double from, double to) const {
  std::optional<std::pair<Vec3, double>> found;
  double most = 0.0;
  const auto first = std::lower_bound(length_.begin(), length_.end(), from);
  for (auto i = static_cast<std::size_t>(first - length_.begin());
       i + 1 < points_.size() && length_[i] <= to; ++i) {
    if (i == 0) continue;
    const double turn = angle_between((points_[i] - points_[i - 1]).normalized(),
                                      (points_[i + 1] - points_[i]).normalized());
    if (turn <= most) continue;
    most = turn;
    found = {points_[i], length_[i]};
  }
  return found;
}

}  // namespace smoothpost
