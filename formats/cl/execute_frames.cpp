
#include "formats/cl/executor.h"
#include "formats/nc/number_text.h"
#include "kernels/core/signed_number.h"

namespace smoothpost::cl {
namespace {

constexpr double kNotOrthogonal = 1e-3;
constexpr double kSameOrigin = 1e-4;  // units of the text
constexpr double kSameAxes = 1e-5;
constexpr int kMostCatiaLines = 3;  // comment lines between $$*CATIA0 and its matrix

bool same_frame(const Mat3& a, const Vec3& p, const Mat3& b, const Vec3& q) {
  return (a - b).cwiseAbs().maxCoeff() < kSameAxes && (p - q).cwiseAbs().maxCoeff() < kSameOrigin;
}

std::string point_text(const Vec3& point) {
  return nc::decimal_text(point.x(), 4) + ", " + nc::decimal_text(point.y(), 4) + ", " +
         nc::decimal_text(point.z(), 4);
}

/// Four numbers between blanks, and nothing else.
bool four_numbers(std::string_view text, std::array<double, 4>& out) {
  std::size_t count = 0;
  while (true) {
    const std::size_t begin = text.find_first_not_of(" \t,");
    if (begin == std::string_view::npos) return count == out.size();
    if (count == out.size()) return false;
    text.remove_prefix(begin);
    const auto [end, error] = from_signed(text, out[count++]);
    if (error != std::errc()) return false;
    text.remove_prefix(static_cast<std::size_t>(end - text.data()));
    if (!text.empty() && text.front() != ' ' && text.front() != '\t' && text.front() != ',')
      return false;
  }
}

}  // namespace

/// MSYS/ox,oy,oz,xx,xy,xz,yx,yy,yz (NX): origin, X and Y axis of the machining coordinates.
void Executor::frame_by_axes(const Statement& statement) {
  if (!read_numbers(statement, {9}, "MSYS/origin, X axis, Y axis (nine values)")) return;
  Mat3 rotation;
  const auto triple = [&](std::size_t i) {
    return Vec3(numbers_[i], numbers_[i + 1], numbers_[i + 2]);
  };
  rotation.col(0) = triple(3);
  rotation.col(1) = triple(6);
  rotation.col(2) = triple(3).cross(triple(6));
  set_frame("MSYS", rotation, triple(0), statement.place);
}

/// CSYS/ three rows of a rotation and an origin (CAMWorks, Creo).
void Executor::frame_by_matrix(const Statement& statement) {
  if (!read_numbers(statement, {12}, "CSYS/ three rows of four values")) return;
  Mat3 rotation;
  Vec3 origin;
  for (Eigen::Index row = 0; row < 3; ++row) {
    const auto first = static_cast<std::size_t>(4 * row);
    for (Eigen::Index column = 0; column < 3; ++column)
      rotation(row, column) = numbers_[first + static_cast<std::size_t>(column)];
    origin[row] = numbers_[first + 3];
  }
  set_frame("CSYS", rotation, origin, statement.place);
}

/// TRNTYP/WORLD,0,0,0 (CAMWorks): coordinates are those of the part, not of CSYS.
void Executor::transformation_type(const Statement& statement) {
  bool world = !statement.items.empty() && statement.items.front().kind == Item::Kind::word &&
               same_word(statement.items.front().text, "WORLD");
  for (std::size_t i = 1; i < statement.items.size(); ++i)
    world =
        world && statement.items[i].kind == Item::Kind::number && statement.items[i].value == 0.0;
  if (world) {
    world_points_ = true;
    move_points_ = false;
    return;
  }
  error("CL142", "this form of TRNTYP is not read; read is TRNTYP/WORLD,0,0,0", statement.place);
}

/// A comment; behind $$*CATIA0 the rows of its matrix.
void Executor::comment_statement(const Statement& statement) {
  comment(statement.text, statement.place);
  if (statement.text.substr(0, 7) == "*CATIA0") {
    catia_lines_ = catia_rows_ = 0;
  } else if (catia_lines_ >= 0) {
    catia_row(statement.text, statement.place);
  }
}

void Executor::catia_row(std::string_view text, TextPlace place) {
  std::array<double, 4> row{};
  if (!four_numbers(text, row)) {
    // The matrix follows the name of the axis system and nothing else.
    if (catia_rows_ > 0 || ++catia_lines_ > kMostCatiaLines) catia_lines_ = -1;
    return;
  }
  catia_rotation_.row(catia_rows_) << row[0], row[1], row[2];
  catia_origin_[catia_rows_] = row[3];
  if (++catia_rows_ < 3) return;
  catia_lines_ = -1;
  set_frame("$$*CATIA0", catia_rotation_, catia_origin_, place);
}

void Executor::set_frame(const char* what, const Mat3& rotation, const Vec3& origin,
                         TextPlace place) {
  const Mat3 error_matrix = rotation.transpose() * rotation - Mat3::Identity();
  const bool right_angles = error_matrix.allFinite() &&
                            error_matrix.cwiseAbs().maxCoeff() < kNotOrthogonal &&
                            rotation.determinant() > 0.0;
  if (right_angles && !in_range(origin, place)) return;
  if (!right_angles) {
    error("CL140",
          std::string(what) +
              ": the axes of the frame are not three right-handed unit vectors at right angles",
          place);
    return;
  }
  if (world_points_) {
    const bool identity = same_frame(rotation, origin, Mat3::Identity(), Vec3::Zero());
    if (!identity && once(world_frame))
      log_.note("CL166",
                std::string(what) +
                    " gives a frame and TRNTYP/WORLD says that coordinates are not in it: they "
                    "are taken as written",
                place);
    return;
  }
  const bool same = frame_given_ && same_frame(rotation, origin, frame_rotation_, frame_origin_);
  if (same) return;
  if (frame_given_ && settings_.frames == FrameRule::one) {
    error("CL141",
          std::string(what) + " gives a second frame (origin " + point_text(origin) +
              ") besides the one with origin " + point_text(frame_origin_) +
              ": say --cl-frames applied to move the coordinates into the frame of these "
              "matrices, or --cl-frames reported when they are in one frame all the same",
          place);
    return;
  }
  frame_rotation_ = Eigen::Quaterniond(rotation).normalized().toRotationMatrix();
  frame_origin_ = origin;
  move_points_ = settings_.frames == FrameRule::applied;
  if (!frame_given_) first_frame(what, place);
  frame_given_ = true;
}

/// Says what becomes of the text's frame.
void Executor::first_frame(const char* what, TextPlace place) {
  const bool identity = same_frame(frame_rotation_, frame_origin_, Mat3::Identity(), Vec3::Zero());
  std::string text;
  switch (settings_.frames) {
    case FrameRule::applied:
      text = "coordinates are moved by the matrices of " + std::string(what) +
             " into the frame that these are given in";
      summary_.assumes.push_back(text);
      break;
    case FrameRule::reported:
      text = "coordinates are taken as written, whatever the matrices of " + std::string(what) +
             " say";
      summary_.assumes.push_back(text);
      break;
    case FrameRule::one:
      if (identity) return;
      text = "coordinates are taken as written, in the frame of " + std::string(what) +
             " with origin " + point_text(frame_origin_) + " (--cl-frames applied moves them)";
      break;
  }
  log_.note("CL166", std::move(text), place);
}

}  // namespace smoothpost::cl
