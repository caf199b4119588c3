#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "kernels/core/canonical_motion.h"

namespace smoothpost::nc {

/// Cutter radius compensation in the XY plane, between an interpreter and its sink. While it is off
/// every call passes. While it is on, motions become those of the tool's centre, beside the
/// programmed contour by the radius, and calls wait for the motion before them.
///
/// With p(s) the contour and n its left normal the centre goes along p + r·n (left) or p − r·n. At
/// a corner that leaves the tool outside an arc of radius r about the corner joins both; at one
/// that holds it inside they end where the offset elements meet, nearest to the corner. The first
/// motion goes from where the tool stands to the offset of its own end; the first one behind the
/// compensation starts from where the centre stands. Motions without X and Y move along. Speeds
/// along the offset are those of the contour (so are the ones of G93).
/// Tests "radius: ..." and LinuxCNC's own (conformance_test.cpp).
///
/// What cannot be is told by `problem` in one sentence: a radius that is not below that of an arc
/// with the tool inside, a corner or element that is too short for the tool, a motion in other
/// planes, machine coordinates or tool-centre-point mode. Memory: one element and what follows it.
class RadiusCompensation final : public CanonicalSink {
 public:
  using Problem = std::function<void(const std::string&, const CanonicalMotion&)>;

  RadiusCompensation(CanonicalSink& sink, Problem problem)
      : sink_(sink), problem_(std::move(problem)) {}

  /// From the next motion on.   @param radius  mm, at least 0; 0: nothing changes
  void begin(double radius, bool left);
  /// Sends what waits; the next motion starts where the centre stands.
  void end();
  bool is_on() const { return on_; }

  void motion(const CanonicalMotion& motion) override;
  void dwell(double seconds, std::uint32_t line) override;
  void event(const ProcessEvent& event) override;
  void comment(std::string_view text, std::uint32_t line) override;
  void tool_length(double length, int tool, std::uint32_t line) override;
  void work_offset(const Vec3& origin, double rotation, int system, std::uint32_t line) override;
  void program_end(std::uint32_t line) override;

 private:
  /// An element of the contour beside which the centre goes.
  struct Element {
    CanonicalMotion motion;         ///< of the centre
    Vec3 corner = Vec3::Zero();     ///< its programmed end
    Vec3 direction = Vec3::Zero();  ///< of the contour at its end, unit, XY
    double speed = 0.0;             ///< mm/s
  };

  void add(const CanonicalMotion& motion);
  void first(const CanonicalMotion& motion);
  void follow(const CanonicalMotion& motion);
  std::optional<CanonicalMotion> beside(const CanonicalMotion& motion) const;
  bool join(Element& next, const Vec3& begin_direction);
  void corner_arc(const Element& next);
  bool shorten(CanonicalMotion& motion, const Vec3& end) const;
  bool start_later(CanonicalMotion& motion, const Vec3& start) const;
  void move_along(const CanonicalMotion& motion);
  void hold(Element next);
  void flush();
  void call(std::function<void()> what);
  void fail(const std::string& text, const CanonicalMotion& motion);

  CanonicalSink& sink_;
  Problem problem_;
  bool on_ = false;
  bool left_ = false;
  bool failed_ = false;
  double radius_ = 0.0;
  std::optional<Element> held_;
  std::vector<CanonicalMotion> along_;          ///< motions without X and Y behind it
  std::vector<std::function<void()>> waiting_;  ///< calls behind it, in order with along_
  bool behind_ = false;         ///< the compensation is off and the centre is not on the contour
  Vec3 centre_ = Vec3::Zero();  ///< where the tool's centre stands
};

}  // namespace smoothpost::nc
