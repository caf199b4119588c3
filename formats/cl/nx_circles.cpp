#include "formats/cl/nx_circles.h"

#include <optional>

#include "formats/cl/arc.h"
#include "formats/cl/statement.h"

namespace smoothpost::cl {
namespace {

constexpr double kAlongTangent = 0.9993908;  // cos 2°
constexpr double kShortest = 1e-6;

std::optional<Vec3> triple(const Statement& statement, std::size_t first) {
  if (statement.items.size() < first + 3) return {};
  Vec3 out;
  for (std::size_t i = 0; i < 3; ++i) {
    if (statement.items[first + i].kind != Item::Kind::number) return {};
    out[static_cast<Eigen::Index>(i)] = statement.items[first + i].value;
  }
  return out;
}

class Counter {
 public:
  TangentVotes count(std::string_view text) {
    Scanner scanner(text, nullptr);
    while (scanner.next()) {
      const Statement& statement = scanner.statement();
      if (statement.kind != Statement::Kind::statement) continue;
      if (statement.word() == Word::circle) {
        circle(statement);
      } else if (statement.word() == Word::go_to) {
        go_to(statement);
      } else if (statement.word() == Word::msys || statement.word() == Word::csys) {
        position_.reset();
        before_.reset();
        circle_.reset();
        pending_ = after_ = false;
      }
    }
    return votes_;
  }

 private:
  void circle(const Statement& statement) {
    circle_.reset();
    pending_ = true;
    after_ = false;
    if (statement.items.size() < kNxCircleValues || !position_) return;
    const auto centre = triple(statement, 0);
    const auto axis = triple(statement, 3);
    if (!centre || !axis || axis->norm() < kShortest) return;
    circle_ = Circle{*centre, axis->normalized(), true, 0.0};
    if (before_) vote(*before_);
  }

  void go_to(const Statement& statement) {
    const auto point = triple(statement, 0);
    if (!point) return;
    if (pending_) {
      pending_ = false;
      after_ = circle_.has_value();
      before_.reset();
    } else if (position_) {
      const Vec3 way = *point - *position_;
      before_.reset();
      if (way.norm() > kShortest) before_ = way.normalized();
      if (after_ && before_) vote(*before_);
      after_ = false;
      circle_.reset();
    }
    position_ = point;
  }

  /// The direction of a motion that ends or begins at `position_`.
  void vote(const Vec3& direction) {
    if (radius_at(*circle_, *position_) < kShortest) return;
    const double along = tangent_at(*circle_, *position_).dot(direction);
    if (along > kAlongTangent) ++votes_.right_hand;
    if (along < -kAlongTangent) ++votes_.left_hand;
  }

  std::optional<Vec3> position_;
  std::optional<Vec3> before_;  ///< direction of the straight motion that led to `position_`
  std::optional<Circle> circle_;
  bool pending_ = false;  ///< the next GOTO ends an arc
  bool after_ = false;    ///< the arc of `circle_` has ended at `position_`
  TangentVotes votes_;
};

}  // namespace

TangentVotes count_tangents(std::string_view text) { return Counter().count(text); }

}  // namespace smoothpost::cl
