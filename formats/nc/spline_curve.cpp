#include "formats/nc/spline_curve.h"

#include <algorithm>

namespace smoothpost::nc {
namespace {

/// A control point times its weight, and the weight.
struct Homogeneous {
  Vec3 p = Vec3::Zero();
  double w = 1.0;
};
using Curve = std::vector<Homogeneous>;

Homogeneous between(const Homogeneous& a, const Homogeneous& b, double share) {
  return {(1.0 - share) * a.p + share * b.p, (1.0 - share) * a.w + share * b.w};
}

Curve homogeneous(const ControlNet& net, const Vec3& origin) {
  Curve curve;
  for (const ControlPoint& c : net) curve.push_back({c.weight * (c.point - origin), c.weight});
  return curve;
}

/// Largest length of the differences of order 1 or 2 of the control points, and of their weights.
struct Differences {
  double p = 0.0;
  double w = 0.0;
};

Differences differences(const Curve& curve, std::size_t order) {
  Differences out;
  for (std::size_t i = 0; i + order < curve.size(); ++i) {
    const Homogeneous& a = curve[i];
    const Homogeneous& b = curve[i + 1];
    Vec3 p = b.p - a.p;
    double w = b.w - a.w;
    if (order == 2) {
      p = curve[i + 2].p - b.p - p;
      w = curve[i + 2].w - b.w - w;
    }
    out.p = std::max(out.p, p.norm());
    out.w = std::max(out.w, std::abs(w));
  }
  return out;
}

/// Upper bound of ‖r''‖ over the curve.
double bend(const Curve& curve) {
  const double degree = static_cast<double>(curve.size() - 1);
  double smallest = curve.front().w;
  for (const Homogeneous& h : curve) smallest = std::min(smallest, h.w);
  const Vec3 origin = curve.front().p / curve.front().w;
  Curve local = curve;
  double reach = 0.0;
  for (Homogeneous& h : local) {
    h.p -= h.w * origin;
    reach = std::max(reach, h.p.norm() / h.w);
  }
  const Differences first = differences(local, 1);
  const Differences second = differences(local, 2);
  const double p1 = degree * first.p, w1 = degree * first.w;
  const double p2 = degree * (degree - 1.0) * second.p;
  const double w2 = degree * (degree - 1.0) * second.w;
  const double speed = (p1 + reach * w1) / smallest;
  return (p2 + 2.0 * speed * w1 + reach * w2) / smallest;
}

struct Halves {
  Curve left;
  Curve right;
};

Halves halve(Curve curve) {
  Halves out;
  out.right.resize(curve.size());
  for (std::size_t left = curve.size(); left > 0; --left) {
    out.left.push_back(curve.front());
    out.right[left - 1] = curve[left - 1];
    for (std::size_t i = 0; i + 1 < left; ++i) curve[i] = between(curve[i], curve[i + 1], 0.5);
  }
  return out;
}

/// The polar form of the NURBS at `arguments` on the span [knots[span], knots[span + 1]].
Homogeneous blossom(const Curve& net, const std::vector<double>& knots, std::size_t span,
                    const std::vector<double>& arguments) {
  const std::size_t degree = arguments.size();
  Curve d(net.begin() + static_cast<std::ptrdiff_t>(span - degree),
          net.begin() + static_cast<std::ptrdiff_t>(span + 1));
  for (std::size_t r = 1; r <= degree; ++r) {
    for (std::size_t i = degree; i >= r; --i) {
      const double low = knots[span - degree + i];
      const double high = knots[span + 1 + i - r];
      d[i] = between(d[i - 1], d[i], (arguments[r - 1] - low) / (high - low));
    }
  }
  return d[degree];
}

}  // namespace

std::vector<ControlNet> bezier_spans(const ControlNet& net, std::size_t order) {
  const std::size_t degree = order - 1;
  const std::size_t spans = net.size() - degree;
  std::vector<double> knots(order, 0.0);
  for (std::size_t i = 1; i < spans; ++i) knots.push_back(static_cast<double>(i));
  knots.insert(knots.end(), order, static_cast<double>(spans));
  const Curve curve = homogeneous(net, Vec3::Zero());
  std::vector<ControlNet> out;
  for (std::size_t s = 0; s < spans; ++s) {
    const std::size_t span = degree + s;
    ControlNet bezier;
    for (std::size_t k = 0; k <= degree; ++k) {
      std::vector<double> arguments(degree - k, knots[span]);
      arguments.insert(arguments.end(), k, knots[span + 1]);
      const Homogeneous h = blossom(curve, knots, span, arguments);
      bezier.push_back({h.p / h.w, h.w});
    }
    out.push_back(std::move(bezier));
  }
  return out;
}

std::vector<Vec3> follow_bezier(const ControlNet& net, double tolerance, std::size_t most) {
  const Vec3 origin = net.front().point;
  std::vector<Vec3> out;
  std::vector<Curve> open{homogeneous(net, origin)};
  while (!open.empty()) {
    Curve curve = std::move(open.back());
    open.pop_back();
    if (bend(curve) <= 8.0 * tolerance) {
      if (out.size() == most) return {};
      out.push_back(origin + curve.back().p / curve.back().w);
      continue;
    }
    // Pieces still open count too: each gives at least one.
    if (out.size() + open.size() + 2 > most) return {};
    Halves halves = halve(std::move(curve));
    open.push_back(std::move(halves.right));
    open.push_back(std::move(halves.left));
  }
  out.back() = net.back().point;
  return out;
}

}  // namespace smoothpost::nc
