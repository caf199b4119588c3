#include "postproc/pipeline/contour_pieces.h"

#include <algorithm>
#include <cmath>

namespace smoothpost {

namespace {

constexpr double kNoWay = 1e-3;     // mm: samples that near have no direction
constexpr double kAtSample = 0.05;  // of the spacing: a corner that near to a sample is that sample

class Splitter {
 public:
  Splitter(const SampledContour& contour, const std::vector<SurfacePoint>& samples,
           double& left_out)
      : in_(contour), all_(samples), left_out_(left_out) {}

  std::vector<ContourPiece> run() {
    const std::size_t count = all_.size() - 1;
    for (std::size_t i = 0; i <= count; ++i) {
      if (too_flat(all_[i], in_.steepest)) {
        left_out_ += i < count ? in_.spacing : 0.0;
        finish();
        continue;
      }
      now_.samples.push_back(all_[i]);
      if (i == count || !is_corner(i)) continue;
      // Up to the corner itself, with the normals of both sides.
      std::optional<std::pair<Vec3, double>> corner;
      if (place(i) < place(i + 1)) corner = in_.line.corner(place(i), place(i + 1));
      add_corner(corner, all_[i]);
      finish();
      add_corner(corner, all_[i + 1]);
    }
    finish();
    join_across_start();
    return std::move(pieces_);
  }

  bool is_corner(std::size_t i) const {
    return angle_between(all_[i].normal, all_[i + 1].normal) > kCornerTurn;
  }

 private:
  double place(std::size_t i) const {
    const double s = in_.start + in_.spacing * static_cast<double>(i);
    return in_.closed && s > in_.line.length() ? s - in_.line.length()
                                               : std::min(s, in_.line.length());
  }

  void add_corner(const std::optional<std::pair<Vec3, double>>& corner, const SurfacePoint& side) {
    if (corner && (corner->first - side.point).norm() > kAtSample * in_.spacing)
      now_.samples.push_back({corner->first, side.normal, true});
  }

  void finish() {
    const double way =
        now_.samples.size() < 2 ? 0.0 : in_.spacing * static_cast<double>(now_.samples.size() - 1);
    if (way >= kShortestPiece)
      pieces_.push_back(std::move(now_));
    else
      left_out_ += way;
    now_ = ContourPiece{};
  }

  // Of a closed contour in pieces the last one may go on in the first.
  void join_across_start() {
    if (!in_.closed || pieces_.size() < 2) return;
    ContourPiece& first = pieces_.front();
    ContourPiece& last = pieces_.back();
    if (first.samples.front().point != all_.front().point ||
        last.samples.back().point != all_.back().point)
      return;
    last.samples.insert(last.samples.end(), first.samples.begin() + 1, first.samples.end());
    first = std::move(last);
    pieces_.pop_back();
  }

  const SampledContour& in_;
  const std::vector<SurfacePoint>& all_;
  double& left_out_;
  ContourPiece now_;
  std::vector<ContourPiece> pieces_;
};

/// Direction at the start of the samples, or at their end.
Vec3 tangent(const std::vector<SurfacePoint>& s, bool at_end) {
  const std::size_t n = s.size();
  const SurfacePoint& end = at_end ? s[n - 1] : s[0];
  for (std::size_t k = 1; k < n; ++k) {
    const Vec3 d = at_end ? Vec3(end.point - s[n - 1 - k].point) : Vec3(s[k].point - end.point);
    const Vec3 along = d - d.dot(end.normal) * end.normal;
    if (along.norm() > kNoWay) return along.normalized();
  }
  return end.normal.unitOrthogonal();
}

}  // namespace

bool too_flat(const SurfacePoint& point, double steepest) {
  return std::abs(point.normal.z()) > std::sin(steepest);
}

std::vector<ContourPiece> split_contour(const SampledContour& contour,
                                        std::vector<SurfacePoint> samples, double& left_out) {
  if (samples.size() < 2) return {};
  Splitter splitter(contour, samples, left_out);
  bool whole = contour.closed;
  for (std::size_t i = 0; whole && i + 1 < samples.size(); ++i)
    whole = !splitter.is_corner(i) && !too_flat(samples[i], contour.steepest);
  if (!whole) return splitter.run();
  std::vector<ContourPiece> one;
  one.push_back({std::move(samples), true});
  return one;
}

std::vector<SurfacePoint> with_leads(const std::vector<SurfacePoint>& samples, double radius,
                                     double spacing) {
  std::vector<SurfacePoint> out;
  const auto steps = static_cast<int>(std::ceil(0.5 * kPi * radius / spacing));
  const auto add = [&](const SurfacePoint& at, const Vec3& direction, int from, int to,
                       double side) {
    for (int k = from; k < to; ++k) {
      const double angle = 0.5 * kPi * (side < 0.0 ? steps - k : k) / steps;
      out.push_back({at.point + radius * (1.0 - std::cos(angle)) * at.normal +
                         side * radius * std::sin(angle) * direction,
                     at.normal, false});
    }
  };
  add(samples.front(), tangent(samples, false), 0, steps, -1.0);
  out.insert(out.end(), samples.begin(), samples.end());
  add(samples.back(), tangent(samples, true), 1, steps + 1, 1.0);
  return out;
}

}  // namespace smoothpost
