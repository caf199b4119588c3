#pragma once

#include <cmath>
#include <random>
#include <vector>

#include "kernels/optimise/placement_margins.h"

// Paths to be placed, and random numbers with a fixed seed.
namespace smoothpost::test {

class Dice {
 public:
  explicit Dice(unsigned seed) : engine_(seed) {}
  double between(double low, double high) {
    return low + (high - low) * static_cast<double>(engine_()) / 4294967296.0;
  }
  Vec3 unit() {
    while (true) {
      const Vec3 v(between(-1, 1), between(-1, 1), between(-1, 1));
      if (v.norm() > 0.1 && v.norm() < 1.0) return v.normalized();
    }
  }
  Pose pose(double size) {
    Pose out = Pose::Identity();
    out.linear() = Eigen::AngleAxisd(between(-M_PI, M_PI), unit()).toRotationMatrix();
    out.translation() = size * Vec3(between(-1, 1), between(-1, 1), between(-1, 1));
    return out;
  }

 private:
  std::mt19937 engine_;
};

/// A closed contour of `size` (mm) in two cuts, the tool leaning about it by up to `lean` (rad).
inline std::vector<PlacementPoint> contour(const Vec3& size, double lean, int count) {
  std::vector<PlacementPoint> points;
  for (int i = 0; i < count; ++i) {
    const double u = 2.0 * M_PI * i / (count - 1);
    PlacementPoint p;
    p.tip = 0.5 * size.cwiseProduct(Vec3(std::cos(u), std::sin(u), std::sin(3.0 * u)));
    p.axis = Vec3(std::sin(lean) * std::cos(2.0 * u), std::sin(lean) * std::sin(2.0 * u),
                  std::cos(lean));
    p.joined = i > 0 && i != count / 2;
    p.line = static_cast<std::uint32_t>(i + 1);
    points.push_back(p);
  }
  return points;
}

inline std::vector<double> spins(int count) {
  std::vector<double> out;
  for (int k = 0; k < count; ++k) out.push_back(2.0 * M_PI * k / count);
  return out;
}

/// X Y Z in the head, C on A in the table; ranges of the linears in mm.
inline ScrewChain table(const Vec3& lower, const Vec3& upper, double turns = 10.0) {
  ScrewChain chain;
  for (int i = 0; i < 3; ++i) {
    ChainJoint j;
    j.direction = Vec3::Unit(i);
    j.lower = lower[i];
    j.upper = upper[i];
    chain.joints.push_back(j);
  }
  ChainJoint a;
  a.kind = JointKind::rotary;
  a.side = ChainSide::workpiece;
  a.direction = Vec3::UnitX();
  a.lower = -2.0;
  a.upper = 0.6;
  chain.joints.push_back(a);
  ChainJoint c = a;
  c.direction = Vec3::UnitZ();
  c.lower = -turns;
  c.upper = turns;
  chain.joints.push_back(c);
  return chain;
}

}  // namespace smoothpost::test
