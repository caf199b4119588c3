#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "formats/nc/offset_corner.h"
#include "formats/nc/plane.h"
#include "kernels/core/canonical_motion.h"

namespace smoothpost::nc {

/// What cutter radius compensation works with from its first motion on.
struct RadiusSettings {
  ToolSide tool;         ///< radius 0: motions pass as they are
  GCode plane = 170;     ///< G17 or G18
  double unit = 1.0;     ///< mm per unit of the program, in which LinuxCNC's tolerances stand
  Vec2 shift{0.0, 0.0};  ///< from the tool's centre to the point that a lathe's words move
  bool straight_entry = false;  ///< an arc is refused as first motion
};

/// Cutter radius compensation between an interpreter and its sink. While it is off every call
/// passes. While it is on, motions become those of the tool's centre as LinuxCNC 2.9 makes them,
/// and other calls wait for the motion before them.
///
/// The first motion goes from where the tool stands to beside the end of its contour: straight, or
/// by the arc of the same sense that is tangent there. Between further elements see
/// corner_between(): an outside corner gets an arc about the corner (a straight piece before a
/// rapid), an inside corner the point where both curves meet. Motions without words of the plane go
/// along at the end before them. The motion behind the compensation goes from where the centre
/// stands to its own end. Speeds along the path of the centre are those along the contour, also
/// those of G93; a corner's arc has that of the element behind it.
///
/// Told by `problem`, once, and then nothing is sent until end(): a way onto the contour that is
/// not longer than the radius, an arc not larger than the tool inside of it, elements that do not
/// meet or whose rest would go backwards, an arc as first motion behind the compensation, an
/// unknown place, motions of other axes, in machine coordinates or tool-centre-point mode.
/// Cost: O(1) for a motion; memory: one element and the calls behind it.
/// Tests "radius: ...", "radius against rs274 ...", LinuxCNC's own (conformance_test.cpp).
class RadiusCompensation final : public CanonicalSink {
 public:
  using Problem = std::function<void(const std::string&, const CanonicalMotion&)>;

  RadiusCompensation(CanonicalSink& sink, Problem problem)
      : sink_(sink), problem_(std::move(problem)) {}

  /// From the next motion on.
  /// @pre the compensation is off; a radius of at least 0
  void begin(const RadiusSettings& settings);
  /// Sends what waits.
  void end();
  bool is_on() const { return on_; }
  /// Motions are changed: on, with a radius above 0.
  bool shifts() const { return on_ && settings_.tool.radius > 0.0; }

  /// It has ended, and no motion has come since.
  bool stands_beside() const { return beside_contour_ && !on_; }

  /// A tool change behind G40: LinuxCNC asks the machine where it stands then, and forgets where
  /// the contour ended. `place` becomes where the centre is, in the plane.   @pre stands_beside()
  void forget_contour(AxisWords& place) {
    place[plane_.first] = stands_.x();
    place[plane_.second] = stands_.y();
    beside_contour_ = false;
  }

  void motion(const CanonicalMotion& motion) override;
  void dwell(double seconds, std::uint32_t line) override;
  void event(const ProcessEvent& event) override;
  void comment(std::string_view text, std::uint32_t line) override;
  void tool_length(double length, int tool, std::uint32_t line) override;
  void work_offset(const Vec3& origin, double rotation, int system, std::uint32_t line) override;
  void program_end(std::uint32_t line) override;

 private:
  /// An element of the contour and the centre's way beside it, whose end waits for the corner.
  struct Element {
    CanonicalMotion motion;
    OffsetCurve begin;      ///< at its programmed start
    OffsetCurve end;        ///< at its programmed end
    Vec2 way{0.0, 0.0};     ///< of a line: from its programmed start to its end
    double sweep = 0.0;     ///< of an arc: as programmed, rad, without sign
    int further_turns = 0;  ///< of an arc: whole turns beyond the first
    double speed = 0.0;     ///< mm/s; 0: a rapid
  };

  Vec2 in_plane(const AxisWords& words) const;
  Element element_of(const CanonicalMotion& motion) const;
  void follow_contour(const CanonicalMotion& motion);
  bool enter(Element& element, const CanonicalMotion& motion);
  bool enter_by_arc(Element& element, const CanonicalMotion& motion);
  bool join(const Element& next);
  bool settle(const Vec2& end);
  void round_corner(const Element& next);
  void leave(const CanonicalMotion& motion);
  void send(CanonicalMotion motion, const Vec2& end, double speed);
  void call(std::function<void(const Vec2&)> what);
  bool fail(const std::string& text, const CanonicalMotion& motion);

  CanonicalSink& sink_;
  Problem problem_;
  RadiusSettings settings_;
  PlaneAxes plane_ = plane_axes(170);
  bool on_ = false;
  bool failed_ = false;
  bool beside_contour_ = false;  ///< off, and the centre stands where it was left
  std::optional<Element> held_;
  std::vector<std::function<void(const Vec2&)>> waiting_;  ///< calls behind it, with its end
  Vec2 centre_{0.0, 0.0};  ///< where the motions that were sent end, without the shift
  Vec2 stands_{0.0, 0.0};  ///< the same with it
};

}  // namespace smoothpost::nc
