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
           double& too_short)
      : in_(contour), all_(samples), too_short_(too_short) {}

  std::vector<ContourPiece> run() {
    const std::size_t count = all_.size() - 1;
    for (std::size_t i = 0; i <= count; ++i) {
      if (in_.out[i]) {
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
      too_short_ += way;
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
  double& too_short_;
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
                                        std::vector<SurfacePoint> samples, double& too_short) {
  if (samples.size() < 2) return {};
  Splitter splitter(contour, samples, too_short);
  bool whole = contour.closed;
  for (std::size_t i = 0; whole && i + 1 < samples.size(); ++i)
    whole = !splitter.is_corner(i) && !contour.out[i];
  if (!whole) return splitter.run();
  std::vector<ContourPiece> one;
  one.push_back({std::move(samples), true});
  return one;
}

std::vector<SurfacePoint> lead_of(const std::vector<SurfacePoint>& samples, double radius,
                                  double spacing, bool at_end) {
  const SurfacePoint& end = at_end ? samples.back() : samples.front();
  const Vec3 direction = tangent(samples, at_end);
  const auto steps = static_cast<int>(std::ceil(0.5 * kPi * radius / spacing));
  const double side = at_end ? 1.0 : -1.0;
  std::vector<SurfacePoint> out;
  for (int k = 0; k < steps; ++k) {
    const double angle = 0.5 * kPi * (at_end ? k + 1 : steps - k) / steps;
    out.push_back({end.point + radius * (1.0 - std::cos(angle)) * end.normal +
                       side * radius * std::sin(angle) * direction,
                   end.normal, false});
  }
  return out;
}

std::optional<std::size_t> sharpest(const std::vector<SurfacePoint>& samples) {
  std::optional<std::size_t> found;
  double most = 0.0;
  for (std::size_t i = 2; i + 1 < samples.size(); ++i) {
    const auto way = [&](std::size_t k) {
      const Vec3 d = samples[k].point - samples[k - 1].point;
      return d.norm() > kNoWay ? Vec3(d.normalized()) : Vec3(Vec3::Zero());
    };
    double turn = angle_between(samples[i - 1].normal, samples[i].normal);
    const Vec3 a = way(i - 1), b = way(i + 1);
    if (!a.isZero() && !b.isZero()) turn += angle_between(a, b);
    if (!(turn > most)) continue;
    most = turn;
    found = i;
  }
  return found;
}

}  // namespace smoothpost
