#include "kernels/collision/mesh_search.h"

#include <algorithm>
#include <limits>
#include <vector>

namespace smoothpost {

namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
/// What additions of coordinates of up to 10⁵ mm may lose, mm.
constexpr double kRoundOff = 1e-9;

/// Smallest value of max(a, b) over a triangle on which both are linear.
struct LinearMinimum {
  double value = kInfinity;
  Vec3 at = Vec3::Zero();
};

/// No point of the box is nearer to the exempt ball's surface, counted inwards.
double ball_bound(const MeshBox& box, const ExemptBall& ball) {
  const Vec3 far = (box.centre - ball.centre).cwiseAbs() + box.half;
  return ball.radius - far.norm() - kRoundOff;
}

LinearMinimum minimum_of_larger(const std::array<Vec3, 3>& corner, const Vec3& a, const Vec3& b) {
  LinearMinimum out;
  const auto offer = [&](double value, const Vec3& at) {
    if (value < out.value) out = {value, at};
  };
  for (std::size_t i = 0; i < 3; ++i) {
    const auto k = static_cast<int>(i);
    const int l = (k + 1) % 3;
    offer(std::max(a[k], b[k]), corner[i]);
    const double here = a[k] - b[k];
    const double there = a[l] - b[l];
    if (here * there >= 0.0) continue;
    const double share = here / (here - there);
    // Both terms meet here; the smaller of two roundings keeps it a lower bound.
    offer(std::min(a[k] + share * (a[l] - a[k]), b[k] + share * (b[l] - b[k])),
          corner[i] + share * (corner[(i + 1) % 3] - corner[i]));
  }
  return out;
}

/// Least margin so far, and what is proven of everything that was left out.
class Standing {
 public:
  explicit Standing(const MarginQuery& query)
      : query_(query), best_(query.want), floor_(query.want) {}

  double best() const { return best_; }
  double floor() const { return std::min(floor_, best_); }
  bool found() const { return found_; }
  bool done() const { return query_.decide && found_ && best_ < 0.0; }
  /// True when nothing that is proven to have at least this margin needs to be looked at.
  bool settles(double lower) {
    if (lower >= best_) return true;
    if (lower < enough()) return false;
    floor_ = std::min(floor_, lower);
    return true;
  }
  /// A lower bound of what was looked at to the end.
  void prove(double lower) { floor_ = std::min(floor_, lower); }
  /// True for a new least margin.
  bool offer(double margin) {
    if (margin >= best_) return false;
    best_ = margin;
    found_ = true;
    return true;
  }
  /// Something with a margin of less than this is there, and will be found.
  void tighten(double margin) { best_ = floor_ = std::min(best_, margin); }

 private:
  double enough() const {
    // A margin that is needed and there has to be known to half of it only: it is worth its time
    // for as long as the bodies do not move by that much.
    if (query_.decide && best_ >= query_.need) {
      const double half = std::max(query_.need, 0.5 * best_);
      return std::min(half, best_ - (query_.exempt ? kExemptTolerance : 0.0));
    }
    return query_.exempt && found_ ? best_ - exempt_tolerance(best_) : best_;
  }

  const MarginQuery& query_;
  double best_;
  double floor_;
  bool found_ = false;
};

/// The search of one query. Shape is ConvexShape (by its core) or TriangleSet; everything is
/// measured in the shape's own frame.
template <class Shape>
class Search {
 public:
  /// @param middle  of the whole body, in the shape's frame
  Search(const TriangleTree& tree, const Shape& shape, const Pose& mesh_from_shape,
         const MarginQuery& query, const Vec3& middle)
      : tree_(tree),
        shape_(shape),
        query_(query),
        standing_(query),
        middle_(middle),
        to_mesh_(mesh_from_shape),
        to_shape_(mesh_from_shape.inverse()),
        offset_(query.clearance + shape.sweep()),
        safe_offset_(offset_ + kRoundOff) {
    if (query.exempt) centre_ = to_shape_ * query.exempt->centre;
  }

  void take_hint() {
    if (!query_.hint) return;
    const auto part = tree_.part_of(*query_.hint);
    if (!part) return;
    if (query_.decide) {
      visit(*part);
      return;
    }
    if (query_.exempt) return;
    // Only as a bound a little above: the triangle that wins is found as without it.
    const TriangleSet triangle = local(*part);
    const auto found =
        convex_distance(shape_, triangle, start_of(shape_.projection(middle_of(triangle))));
    standing_.tighten(found.upper - offset_ + kMarginTolerance);
  }

  /// Visits the part if it may matter.
  void descend(const TreePart& part) { descend(part, bound(part)); }

  MarginBounds result() const {
    MarginBounds out;
    out.found = standing_.found();
    out.upper = standing_.best();
    out.lower = standing_.floor();
    if (!out.found) return out;
    out.triangle = tree_.triangle(*witness_.part);
    out.normal = to_mesh_.linear() * witness_.normal;
    out.on_mesh = to_mesh_ * witness_.on_mesh;
    out.distance = std::max(witness_.distance, 0.0);
    out.on_body = out.on_mesh + out.distance * out.normal;
    return out;
  }

 private:
  struct Witness {
    Vec3 on_mesh = Vec3::Zero();  ///< in the shape's frame
    Vec3 normal = Vec3::UnitZ();
    double distance = 0.0;  ///< from the body, sweep included; negative inside of the sweep
    std::optional<TreePart> part;
  };

  TriangleSet local(const TreePart& part) const {
    const auto& c = tree_.corners(part);
    return {{to_shape_ * c[0], to_shape_ * c[1], to_shape_ * c[2]}};
  }

  /// Margins of a part are at least this.
  double bound(const TreePart& part) const {
    const MeshBox box = tree_.box(part);
    const Projection projection = shape_.projection(to_shape_ * box.centre);
    const Vec3 normal = to_mesh_.linear() * projection.normal;
    const bool outside = projection.distance > 0.0;
    const double from_body =
        outside ? projection.distance - normal.cwiseAbs().dot(box.half) : -kInfinity;
    if (!query_.exempt) return from_body - safe_offset_;
    const ExemptBall& ball = *query_.exempt;
    const double out = std::max(from_body - safe_offset_, ball_bound(box, ball));
    const Vec3 away = box.centre - ball.centre;
    const double distance = away.norm();
    const double squared = box.half.squaredNorm();
    const double nearest = distance - std::sqrt(squared);
    if (!outside || nearest <= 0.0) return out;
    // The larger of two terms is at least their mean, and along the mesh they change against each
    // other: dist(x) ≥ distance at the middle + normal·y, |x − centre| ≤ d + (away/d)·y + |y|²/(2
    // (d − |y|)).
    const double both = projection.distance - safe_offset_ + ball.radius - distance -
                        squared / (2.0 * nearest) - kRoundOff -
                        (normal - away / distance).cwiseAbs().dot(box.half);
    return std::max(out, 0.5 * both);
  }

  void descend(const TreePart& part, double lower) {
    if (standing_.done() || standing_.settles(lower)) return;
    if (part.size() == 1) {
      visit(part);
      return;
    }
    const auto [left, right] = tree_.halves(part);
    const double at_left = left.size() == 1 ? lower : bound(left);
    const double at_right = right.size() == 1 ? lower : bound(right);
    if (at_left <= at_right) {
      descend(left, at_left);
      descend(right, at_right);
    } else {
      descend(right, at_right);
      descend(left, at_left);
    }
  }

  static Vec3 middle_of(const TriangleSet& t) {
    return (t.corner[0] + t.corner[1] + t.corner[2]) / 3.0;
  }
  static Vec3 start_of(const Projection& projection) {
    return projection.distance > 0.0 ? Vec3(-projection.normal) : Vec3(Vec3::UnitZ());
  }

  void offer(double margin, const Witness& witness) {
    if (standing_.offer(margin)) witness_ = witness;
  }

  void visit(const TreePart& part) {
    const TriangleSet triangle = local(part);
    if (query_.exempt && cut_by_ball(triangle)) {
      halve(triangle, part);
      return;
    }
    const Vec3 middle = middle_of(triangle);
    const Projection projection = shape_.projection(middle);
    if (projection.distance > 0.0) {
      double nearest = kInfinity;
      for (const Vec3& c : triangle.corner)
        nearest = std::min(nearest, projection.normal.dot(c - middle));
      if (standing_.settles(projection.distance + nearest - safe_offset_)) return;
    }
    const ConvexDistance found =
        convex_distance(shape_, triangle, start_of(projection), standing_.best() + safe_offset_);
    const double lower = found.lower - safe_offset_;
    if (lower >= standing_.best()) return;
    Witness witness;
    witness.on_mesh = found.on_b;
    witness.normal = found.normal;
    if (found.upper > kConvexTouching) witness.normal = (found.on_a - found.on_b) / found.upper;
    witness.distance = found.upper - shape_.sweep();
    witness.part = part;
    if (found.overlap) witness.normal = face_normal(triangle);
    const double margin = found.upper - offset_;
    if (query_.exempt && margin < to_surface(found.on_b)) {
      halve(triangle, part);
      return;
    }
    standing_.prove(lower);
    offer(margin, witness);
  }

  /// Of a triangle that cuts the body's core: out of a solid, else to the body's middle.
  Vec3 face_normal(const TriangleSet& t) const {
    const Vec3 normal = (t.corner[1] - t.corner[0]).cross(t.corner[2] - t.corner[0]).normalized();
    const bool outward =
        tree_.solid() ? tree_.signed_volume() >= 0.0 : normal.dot(middle_ - t.corner[0]) >= 0.0;
    return outward ? normal : Vec3(-normal);
  }

  double to_surface(const Vec3& point) const {
    return query_.exempt->radius - (point - centre_).norm();
  }

  bool cut_by_ball(const TriangleSet& triangle) const {
    return triangle.projection(centre_).distance < query_.exempt->radius;
  }

  /// Halves a triangle until every piece is decided; see MarginQuery for the margin.
  void halve(const TriangleSet& triangle, const TreePart& part) {
    pieces_.clear();
    pieces_.push_back(triangle.corner);
    while (!pieces_.empty() && !standing_.done()) {
      const auto corner = pieces_.back();
      pieces_.pop_back();
      visit_piece(corner, part);
    }
  }

  void visit_piece(const std::array<Vec3, 3>& corner, const TreePart& part) {
    const Vec3 ball(to_surface(corner[0]) - kRoundOff, to_surface(corner[1]) - kRoundOff,
                    to_surface(corner[2]) - kRoundOff);
    if (standing_.settles(ball.minCoeff())) return;
    const LinearMinimum low = piece_minimum(corner, middle_of(TriangleSet{corner}), ball, part);
    if (standing_.settles(low.value)) return;
    // A plane where the bound is lowest bounds better there.
    const LinearMinimum again = piece_minimum(corner, low.at, ball, part);
    if (standing_.settles(std::max(low.value, again.value))) return;
    std::size_t longest = 0;
    double squared = 0.0;
    for (std::size_t k = 0; k < 3; ++k) {
      const double side = (corner[(k + 1) % 3] - corner[k]).squaredNorm();
      if (side <= squared) continue;
      squared = side;
      longest = k;
    }
    if (squared < kRoundOff * kRoundOff) {
      standing_.prove(std::max(low.value, again.value));
      return;
    }
    const Vec3 middle = 0.5 * (corner[longest] + corner[(longest + 1) % 3]);
    auto first = corner;
    auto second = corner;
    first[(longest + 1) % 3] = middle;
    second[longest] = middle;
    pieces_.push_back(first);
    pieces_.push_back(second);
  }

  /// Lower bound over a piece with the plane that separates the body from `point`; offers the
  /// margin of `point` itself. The ball's term is concave: the linear function through its corners
  /// is below it.
  LinearMinimum piece_minimum(const std::array<Vec3, 3>& corner, const Vec3& point,
                              const Vec3& ball, const TreePart& part) {
    const Projection projection = shape_.projection(point);
    Vec3 plane;
    for (std::size_t k = 0; k < 3; ++k)
      plane[static_cast<int>(k)] =
          projection.distance > 0.0
              ? projection.distance + projection.normal.dot(corner[k] - point) - safe_offset_
              : -safe_offset_;
    Witness witness;
    witness.on_mesh = point;
    witness.normal = Vec3(-projection.normal);
    witness.distance = projection.distance - shape_.sweep();
    witness.part = part;
    if (projection.distance <= 0.0) witness.normal = face_normal(TriangleSet{corner});
    offer(std::max(projection.distance - offset_, to_surface(point)), witness);
    return minimum_of_larger(corner, plane, ball);
  }

  const TriangleTree& tree_;
  const Shape& shape_;
  const MarginQuery& query_;
  Standing standing_;
  Vec3 middle_;
  Pose to_mesh_;
  Pose to_shape_;
  double offset_;       // margin = distance from the core − offset_
  double safe_offset_;  // for lower bounds
  Vec3 centre_ = Vec3::Zero();
  Witness witness_;
  std::vector<std::array<Vec3, 3>> pieces_;
};

/// Two trees at once: the larger box is halved, down to a triangle of the body, which then searches
/// what is left of the mesh.
class DualSearch {
 public:
  DualSearch(const TriangleTree& tree, const TriangleTree& body, const Pose& mesh_from_body,
             const MarginQuery& query)
      : tree_(tree),
        body_(body),
        query_(query),
        to_mesh_(mesh_from_body),
        to_body_(mesh_from_body.inverse()),
        middle_(0.5 * (body.min() + body.max())),
        standing_(query) {}

  MarginBounds run() {
    const TreePart a = body_.whole();
    const TreePart b = tree_.whole();
    descend(a, b, bound(body_.box(a), tree_.box(b)));
    result_.found = standing_.found();
    result_.upper = standing_.best();
    result_.lower = standing_.floor();
    return result_;
  }

 private:
  /// Of the distance of two boxes that stand askew: from the middle of one to the other box.
  static double plane_bound(const MeshBox& fixed, const MeshBox& moving, const Pose& pose) {
    const Vec3 middle = pose * moving.centre - fixed.centre;
    const Vec3 away = middle - middle.cwiseMax(-fixed.half).cwiseMin(fixed.half);
    const double distance = away.norm();
    if (distance <= 0.0) return -kInfinity;
    const Vec3 normal = pose.linear().transpose() * away;
    return distance - normal.cwiseAbs().dot(moving.half) / distance;
  }

  double bound(const MeshBox& a, const MeshBox& b) const {
    const double offset = query_.clearance + kRoundOff;
    double out = plane_bound(b, a, to_mesh_) - offset;
    if (out < standing_.best()) out = std::max(out, plane_bound(a, b, to_body_) - offset);
    if (query_.exempt) out = std::max(out, ball_bound(b, *query_.exempt));
    return out;
  }

  void descend(const TreePart& a, const TreePart& b, double lower) {
    if (standing_.done() || standing_.settles(lower)) return;
    if (a.size() == 1) {
      search_from(a, b);
      return;
    }
    const MeshBox box_a = body_.box(a);
    const MeshBox box_b = tree_.box(b);
    const bool halve_a = b.size() == 1 || box_a.half.squaredNorm() >= box_b.half.squaredNorm();
    const auto [left, right] = halve_a ? body_.halves(a) : tree_.halves(b);
    const double at_left = halve_a ? bound(body_.box(left), box_b) : bound(box_a, tree_.box(left));
    const double at_right =
        halve_a ? bound(body_.box(right), box_b) : bound(box_a, tree_.box(right));
    const auto go = [&](const TreePart& part, double at) {
      halve_a ? descend(part, b, at) : descend(a, part, at);
    };
    if (at_left <= at_right) {
      go(left, at_left);
      go(right, at_right);
    } else {
      go(right, at_right);
      go(left, at_left);
    }
  }

  void search_from(const TreePart& a, const TreePart& b) {
    MarginQuery query = query_;
    query.want = standing_.best();
    query.hint = std::nullopt;
    const TriangleSet triangle{body_.corners(a)};
    Search<TriangleSet> search(tree_, triangle, to_mesh_, query, middle_);
    search.descend(b);
    const MarginBounds found = search.result();
    standing_.prove(found.lower);
    if (found.found && standing_.offer(found.upper)) result_ = found;
  }

  const TriangleTree& tree_;
  const TriangleTree& body_;
  const MarginQuery& query_;
  Pose to_mesh_;
  Pose to_body_;
  Vec3 middle_;
  Standing standing_;
  MarginBounds result_;
};

}  // namespace

double exempt_tolerance(double margin) {
  return std::max(kExemptTolerance, 0.05 * std::abs(margin));
}

MarginBounds mesh_margin(const TriangleTree& tree, const ConvexShape& body, const Pose& pose,
                         const MarginQuery& query) {
  Search<ConvexShape> search(tree, body, pose * body.core_frame(), query, Vec3::Zero());
  search.take_hint();
  search.descend(tree.whole());
  return search.result();
}

MarginBounds mesh_margin(const TriangleTree& tree, const TriangleTree& body, const Pose& pose,
                         const MarginQuery& query) {
  return DualSearch(tree, body, pose, query).run();
}

bool inside(const TriangleTree& tree, const Vec3& point, std::uint32_t hint) {
  if (!tree.solid()) return false;
  if ((point.array() < tree.min().array()).any() || (point.array() > tree.max().array()).any())
    return false;
  const double signed_distance = tree.closest(point, hint).signed_distance;
  return tree.signed_volume() < 0.0 ? signed_distance > 0.0 : signed_distance < 0.0;
}

}  // namespace smoothpost
