#include "examples/paper_a/paper_paths.h"

#include <algorithm>
#include <cmath>

namespace smoothpost::paper_a {

namespace {

using Six = Eigen::Matrix<double, 6, 1>;

constexpr int kSamples = 400;  // of a piece

Six six(const Vec3& tip, const Vec3& angles) {
  Six v;
  v << tip, angles;
  return v;
}

std::array<Six, 4> by_parameter(const Piece& piece, double t) {
  std::array<Six, 4> d;
  for (Eigen::Index c = 0; c < 6; ++c) {
    const SepticValue v = evaluate(piece.col(c), t);
    d[0][c] = v.value;
    d[1][c] = v.d1;
    d[2][c] = v.d2;
    d[3][c] = v.d3;
  }
  return d;
}

Piece straight(const Six& from, const Six& to) {
  Piece piece = Piece::Zero();
  piece.row(0) = from.transpose();
  piece.row(1) = (to - from).transpose();
  return piece;
}

/// Angles with slopes a and b by s at the ends, second and third derivative 0 there.
Piece septic_link(const Six& from, const Six& to, const Vec3& a, const Vec3& b) {
  Piece piece = straight(from, to);
  const double length = (to - from).head<3>().norm();
  // The span of AcrShape {1, 0}: slope at the start p2 − p0, at the end p3 − p1.
  for (Eigen::Index c = 0; c < 3; ++c) {
    const double start = from[c + 3];
    const double end = to[c + 3];
    piece.col(c + 3) = acr_span(
        {1.0, 0.0}, Eigen::Vector4d(end - length * a[c], start, end, start + length * b[c]));
  }
  return piece;
}

struct Corner {
  LiteralCorner tip, angle;
  AcrShape tip_shape, angle_shape;
  Six point(std::size_t j) const { return six(tip.points[j], angle.points[j]); }
  /// dφ/ds at Q1 (j = 1) or Q9.
  Vec3 slope(std::size_t j) const {
    return angle_shape.kappa / tip_shape.kappa * (angle.points[j + 1] - angle.points[j - 1]) /
           (tip.points[j + 1] - tip.points[j - 1]).norm();
  }
  Piece span(std::size_t i) const {
    Piece piece;
    for (Eigen::Index c = 0; c < 3; ++c) {
      Eigen::Vector4d p, a;
      for (std::size_t k = 0; k < 4; ++k) {
        p[static_cast<Eigen::Index>(k)] = tip.points[i - 1 + k][c];
        a[static_cast<Eigen::Index>(k)] = angle.points[i - 1 + k][c];
      }
      piece.col(c) = acr_span(tip_shape, p);
      piece.col(c + 3) = acr_span(angle_shape, a);
    }
    return piece;
  }
};

/// §4 between two corners: U1 U2 U6 U7 U3 U4.
void add_literal_link(const Corner& before, const Corner& after, std::vector<Piece>& path) {
  const std::array<Six, 6> u = {before.point(9),
                                before.point(10),
                                2.0 * before.point(10) - before.point(9),
                                2.0 * after.point(0) - after.point(1),
                                after.point(0),
                                after.point(1)};
  for (std::size_t k = 0; k + 1 < u.size(); ++k) path.push_back(straight(u[k], u[k + 1]));
}

// Gauss' rule of three places.
constexpr std::array<double, 3> kPlaces = {-0.774596669241483, 0.0, 0.774596669241483};
constexpr std::array<double, 3> kWeights = {5.0 / 9.0, 8.0 / 9.0, 5.0 / 9.0};

template <typename Speed>
double integral_of(Speed speed, double from, double to, int parts) {
  const double half = 0.5 * (to - from) / parts;
  double sum = 0.0;
  for (int part = 0; part < parts; ++part)
    for (std::size_t i = 0; i < 3; ++i)
      sum += half * kWeights[i] * speed(from + half * (2.0 * part + 1.0 + kPlaces[i]));
  return sum;
}

double length_of(const Piece& piece, double from, double to, int parts) {
  return integral_of([&](double t) { return by_parameter(piece, t)[1].head<3>().norm(); }, from, to,
                     parts);
}

Pose pose_of(const Six& v) {
  Pose pose = Pose::Identity();
  pose.translation() = v.head<3>();
  pose.linear() = rotation_from_rpy(v[5], v[4], v[3]);
  return pose;
}

/// Tip and doubled quaternion by the arc length, on one side.
std::array<Eigen::Vector4d, 4> quaternion_by_arc_length(const PoseDerivatives& d) {
  const double s1 = d.tip[1].norm();
  const double s2 = d.tip[1].dot(d.tip[2]) / s1;
  const double s3 = (d.tip[2].squaredNorm() + d.tip[1].dot(d.tip[3]) - s2 * s2) / s1;
  std::array<Eigen::Vector4d, 4> q = d.rotation;
  q[1] = d.rotation[1] / s1;
  q[2] = (d.rotation[2] - s2 * q[1]) / (s1 * s1);
  q[3] = (d.rotation[3] - s3 * q[1] - 3.0 * s1 * s2 * q[2]) / (s1 * s1 * s1);
  for (Eigen::Vector4d& v : q) v *= 2.0;
  return q;
}

double length_of(const CornerPath& path, std::size_t leg, double from, double to) {
  return integral_of([&](double x) { return path.derivatives(leg, x).tip[1].norm(); }, from, to, 2);
}

double curvature(const Vec3& d1, const Vec3& d2) {
  return d1.cross(d2).norm() / std::pow(d1.norm(), 3);
}

}  // namespace

ArcDerivatives by_arc_length(const Piece& piece, double t) {
  const auto d = by_parameter(piece, t);
  const Vec3 r1 = d[1].head<3>(), r2 = d[2].head<3>(), r3 = d[3].head<3>();
  const double s1 = r1.norm();
  const double s2 = r1.dot(r2) / s1;
  const double s3 = (r2.squaredNorm() + r1.dot(r3) - s2 * s2) / s1;
  ArcDerivatives a;
  a[0] = d[0];
  a[1] = d[1] / s1;
  a[2] = (d[2] - s2 * a[1]) / (s1 * s1);
  a[3] = (d[3] - s3 * a[1] - 3.0 * s1 * s2 * a[2]) / (s1 * s1 * s1);
  return a;
}

std::vector<Piece> polyline() {
  std::vector<Piece> path;
  for (std::size_t i = 0; i + 1 < kTips.size(); ++i)
    path.push_back(straight(six(kTips[i], kAngles[i]), six(kTips[i + 1], kAngles[i + 1])));
  return path;
}

std::vector<Piece> paper_path(const Tolerances& tolerances, SignOfM2 sign, Links links) {
  std::vector<Corner> corners;
  for (std::size_t i = 1; i <= 3; ++i) {
    Corner c{tip_corner(i, tolerances.tip), angle_corner(i, tolerances.axis), {}, {}};
    c.tip_shape = literal_fit(c.tip, sign).shape;
    c.angle_shape = literal_fit(c.angle, sign).shape;
    corners.push_back(c);
  }
  std::vector<Piece> path;
  const auto end_link = [&](const Six& from, const Six& to, const Vec3& a, const Vec3& b) {
    path.push_back(links == Links::septic ? septic_link(from, to, a, b) : straight(from, to));
  };
  const auto mean = [](const Six& from, const Six& to) -> Vec3 {
    return (to - from).tail<3>() / (to - from).head<3>().norm();
  };
  const Six first = six(kTips.front(), kAngles.front());
  const Six last = six(kTips.back(), kAngles.back());
  end_link(first, corners[0].point(1), mean(first, corners[0].point(1)), corners[0].slope(1));
  for (std::size_t i = 0; i < corners.size(); ++i) {
    for (std::size_t span = 1; span <= 8; ++span) path.push_back(corners[i].span(span));
    if (i + 1 == corners.size()) break;
    if (links == Links::literal)
      add_literal_link(corners[i], corners[i + 1], path);
    else
      end_link(corners[i].point(9), corners[i + 1].point(1), corners[i].slope(9),
               corners[i + 1].slope(1));
  }
  end_link(corners[2].point(9), last, corners[2].slope(9), mean(corners[2].point(9), last));
  return path;
}

CornerPath common_parameter(const Tolerances& tolerances, BlendKind kind) {
  std::vector<PathNode> nodes;
  std::vector<PathLeg> legs;
  for (std::size_t i = 0; i < kTips.size(); ++i)
    nodes.push_back({kTips[i], Eigen::Quaterniond(rotation_from_rpy(kAngles[i].z(), kAngles[i].y(),
                                                                    kAngles[i].x()))});
  for (std::size_t i = 0; i + 1 < nodes.size(); ++i)
    legs.push_back(
        {rotation_log((nodes[i].rotation.inverse() * nodes[i + 1].rotation).toRotationMatrix())});
  CornerSettings settings;
  settings.kind = kind;
  settings.tip_tolerance = tolerances.tip;
  settings.rotation_tolerance = tolerances.axis;
  settings.tool_axis = Vec3::UnitZ();
  return CornerPath(nodes, legs, {}, settings);
}

std::vector<Pose> sample(const std::vector<Piece>& path, double step) {
  std::vector<Pose> poses;
  double next = 0.0;  // from the start of the piece
  for (const Piece& piece : path) {
    double left = length_of(piece, 0.0, 1.0, 24);
    double t = 0.0;
    while (next < left) {
      const double from = t;
      for (int i = 0; i < 4; ++i)
        t += (next - length_of(piece, from, t, 2)) / by_parameter(piece, t)[1].head<3>().norm();
      poses.push_back(pose_of(by_parameter(piece, t)[0]));
      left -= next;
      next = step;
    }
    next -= left;
  }
  return poses;
}

std::vector<Pose> sample(const CornerPath& path, double step) {
  std::vector<Pose> poses;
  double next = 0.0;
  for (std::size_t leg = 0; leg < path.legs(); ++leg) {
    const auto breaks = path.breaks(leg);
    for (std::size_t k = 0; k + 1 < breaks.size(); ++k) {
      // Fixed steps of Runge and Kutta for dσ/ds = 1/|r'| would do; Simpson's table is exact
      // enough.
      constexpr int kCells = 64;
      const double cell = (breaks[k + 1] - breaks[k]) / kCells;
      for (int i = 0; i < kCells; ++i) {
        const double from = breaks[k] + cell * i;
        const double length = length_of(path, leg, from, from + cell);
        double x = from;
        while (next < length) {
          for (int n = 0; n < 4; ++n)
            x += (next - length_of(path, leg, from, x)) / path.derivatives(leg, x).tip[1].norm();
          poses.push_back(path.at(leg, x));
          next += step;
        }
        next -= length;
      }
    }
  }
  return poses;
}

SynchronisationErrors synchronisation(const std::vector<Piece>& path) {
  SynchronisationErrors e;
  for (std::size_t i = 0; i < path.size(); ++i) {
    for (int j = 0; j <= kSamples; ++j) {
      const auto d = by_arc_length(path[i], static_cast<double>(j) / kSamples);
      for (std::size_t k = 0; k < 3; ++k)
        e.peak[k] = std::max(e.peak[k], d[k + 1].tail<3>().norm());
    }
    if (i + 1 == path.size()) break;
    const auto left = by_arc_length(path[i], 1.0);
    const auto right = by_arc_length(path[i + 1], 0.0);
    for (std::size_t k = 0; k < 3; ++k)
      e.at_junctions[k] =
          std::max(e.at_junctions[k], (left[k + 1] - right[k + 1]).tail<3>().norm());
  }
  return e;
}

SynchronisationErrors synchronisation(const CornerPath& path) {
  SynchronisationErrors e;
  const auto compare = [&](const PoseDerivatives& a, const PoseDerivatives& b) {
    const auto left = quaternion_by_arc_length(a);
    const auto right = quaternion_by_arc_length(b);
    const double sign = left[0].dot(right[0]) < 0.0 ? -1.0 : 1.0;
    for (std::size_t k = 0; k < 3; ++k)
      e.at_junctions[k] = std::max(e.at_junctions[k], (left[k + 1] - sign * right[k + 1]).norm());
  };
  for (std::size_t leg = 0; leg < path.legs(); ++leg) {
    const auto b = path.breaks(leg);
    for (std::size_t k = 0; k + 1 < b.size(); ++k)
      for (int j = 0; j <= kSamples; ++j) {
        const auto d = quaternion_by_arc_length(
            path.derivatives(leg, b[k] + (b[k + 1] - b[k]) * j / kSamples));
        for (std::size_t n = 0; n < 3; ++n) e.peak[n] = std::max(e.peak[n], d[n + 1].norm());
      }
    for (std::size_t k = 1; k + 1 < b.size(); ++k) {
      const double inside = 4e-16 * path.length(leg);
      compare(path.derivatives(leg, b[k] - inside), path.derivatives(leg, b[k] + inside));
    }
    if (leg + 1 < path.legs())
      compare(path.derivatives(leg, path.length(leg)), path.derivatives(leg + 1, 0.0));
  }
  return e;
}

std::vector<std::array<double, 2>> rates(const std::vector<Piece>& path) {
  std::vector<std::array<double, 2>> out;
  double s = 0.0;
  for (const Piece& piece : path) {
    for (int j = 0; j <= 20; ++j)
      out.push_back({s + length_of(piece, 0.0, j / 20.0, 12),
                     by_arc_length(piece, j / 20.0)[1].tail<3>().norm()});
    s += length_of(piece, 0.0, 1.0, 12);
  }
  return out;
}

std::vector<std::array<double, 2>> rates(const CornerPath& path) {
  std::vector<std::array<double, 2>> out;
  double s = 0.0;
  for (std::size_t leg = 0; leg < path.legs(); ++leg) {
    const auto b = path.breaks(leg);
    for (std::size_t k = 0; k + 1 < b.size(); ++k)
      for (int j = 0; j < 40; ++j) {
        const double x = b[k] + (b[k + 1] - b[k]) * j / 40.0;
        out.push_back({s, quaternion_by_arc_length(path.derivatives(leg, x))[1].norm()});
        s += length_of(path, leg, x, x + (b[k + 1] - b[k]) / 40.0);
      }
  }
  return out;
}

double peak_curvature(const std::vector<Piece>& path) {
  double most = 0.0;
  for (const Piece& piece : path)
    for (int j = 0; j <= kSamples; ++j) {
      const auto d = by_parameter(piece, static_cast<double>(j) / kSamples);
      most = std::max(most, curvature(d[1].head<3>(), d[2].head<3>()));
    }
  return most;
}

double peak_curvature(const CornerPath& path) {
  double most = 0.0;
  for (std::size_t leg = 0; leg < path.legs(); ++leg) {
    const auto b = path.breaks(leg);
    for (std::size_t k = 0; k + 1 < b.size(); ++k)
      for (int j = 0; j <= kSamples; ++j) {
        const auto d = path.derivatives(leg, b[k] + (b[k + 1] - b[k]) * j / kSamples);
        most = std::max(most, curvature(d.tip[1], d.tip[2]));
      }
  }
  return most;
}

}  // namespace smoothpost::paper_a
