#include "kernels/geometry/part_registration.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <limits>
#include <optional>
#include <utility>

#include "kernels/core/contract.h"
#include "kernels/core/units.h"

namespace smoothpost {

namespace {

using Points = std::vector<CutterLocation>;

constexpr std::size_t kSamples = 2000;        // points that judge a hypothesis
constexpr std::size_t kFittingSamples = 400;  // points that refine a shift
constexpr std::size_t kCoarseSamples = 60;    // points that try the grid of shifts
constexpr int kGrid = 4;                      // shifts per axis
constexpr std::size_t kRefined = 4;           // shifts of the grid that are refined
constexpr double kShare = 0.95;               // of the points that an explanation must bring within
constexpr double kSeen = 1e-4;  // smallest mean (n·d)² of a direction d that gaps see

/// A hypothesis: what is done to the program's points and how gaps are then read.
struct Hypothesis {
  double ratio = 1.0;
  int mirror = -1;
  Vec3 offset = Vec3::Zero();
  double gap_factor = 1.0;  // from distances in the mesh's numbers to mm
  bool flip = false;        // the mesh's normals are taken the other way round
};

CutterLocation moved(const CutterLocation& point, const Hypothesis& hypothesis) {
  CutterLocation out = point;
  out.tip *= hypothesis.ratio;
  if (hypothesis.mirror >= 0) {
    out.tip[hypothesis.mirror] = -out.tip[hypothesis.mirror];
    out.axis[hypothesis.mirror] = -out.axis[hypothesis.mirror];
  }
  out.tip += hypothesis.offset;
  return out;
}

/// At most `count` points, evenly spaced in the order of the program.
Points sampled(const Points& points, std::size_t count) {
  if (points.size() <= count) return points;
  Points out;
  out.reserve(count);
  for (std::size_t i = 0; i < count; ++i) out.push_back(points[i * points.size() / count]);
  return out;
}

class Judge {
 public:
  Judge(const TriangleTree& tree, const RegistrationSettings& settings)
      : tree_(tree), settings_(settings), open_(tree.open()) {}

  GapStatistics measure(const Points& points, const Hypothesis& hypothesis) const {
    std::vector<double> gaps(points.size());
    std::vector<double> angles(points.size());
    std::size_t facing_away = 0;
    std::uint32_t hint = 0;
    for (std::size_t i = 0; i < points.size(); ++i) {
      const CutterLocation point = moved(points[i], hypothesis);
      const ClosestPoint closest = tree_.closest(point.tip, hint);
      hint = closest.triangle;
      angles[i] = angle_between(point.axis, closest.normal);
      gaps[i] = hypothesis.gap_factor * closest.signed_distance;
      facing_away += point.axis.dot(closest.normal) < 0.0;
    }
    GapStatistics out;
    out.sides_exchanged = open_ && 2 * facing_away > points.size();
    if (out.sides_exchanged || hypothesis.flip)
      for (std::size_t i = 0; i < points.size(); ++i) {
        gaps[i] = -gaps[i];
        angles[i] = kPi - angles[i];
      }
    summarise(gaps, angles, out);
    return out;
  }

  bool fits(const GapStatistics& s) const {
    const double least = kShare * static_cast<double>(s.points);
    return static_cast<double>(s.within) >= least && static_cast<double>(s.angles_within) >= least;
  }

  const TriangleTree& tree() const { return tree_; }
  const RegistrationSettings& settings() const { return settings_; }
  bool open() const { return open_; }

 private:
  void summarise(const std::vector<double>& gaps, std::vector<double>& angles,
                 GapStatistics& out) const {
    out.points = gaps.size();
    const auto [lowest, highest] = std::minmax_element(gaps.begin(), gaps.end());
    out.min = *lowest;
    out.max = *highest;
    for (std::size_t i = 0; i < gaps.size(); ++i) {
      const double deviation = std::abs(gaps[i] - settings_.nominal_gap);
      out.mean_deviation += deviation;
      out.within += deviation <= settings_.allowed_gap_deviation;
      out.angles_within += angles[i] <= settings_.allowed_angle;
      if (deviation > out.worst_deviation) {
        out.worst_deviation = deviation;
        out.worst = i;
      }
    }
    out.mean_deviation /= static_cast<double>(gaps.size());
    const auto widest = std::max_element(angles.begin(), angles.end());
    out.worst_angle = *widest;
    out.worst_angle_point = static_cast<std::size_t>(widest - angles.begin());
    const auto middle = angles.begin() + static_cast<std::ptrdiff_t>(angles.size() / 2);
    std::nth_element(angles.begin(), middle, angles.end());
    out.median_angle = *middle;
  }

  const TriangleTree& tree_;
  const RegistrationSettings& settings_;
  bool open_;
};

/// The shift that brings points to the nominal gap, by damped point-to-plane steps.
class ShiftSearch {
 public:
  ShiftSearch(const Judge& judge, const Points& points) : judge_(judge), points_(points) {}

  struct Fit {
    Vec3 offset = Vec3::Zero();
    double cost = 0.0;  ///< mean of min(|deviation|, 4 · allowed)
  };

  /// Iterates from `start` on at most `count` points.
  Fit refine(const Vec3& start, std::size_t count, int iterations) const {
    const Points points = sampled(points_, count);
    std::vector<std::uint32_t> hints(points.size(), 0);
    Fit fit{start, 0.0};
    for (int k = 0; k < iterations; ++k) {
      const Vec3 step = solve(normal_equations(points, fit.offset, hints));
      fit.offset += step;
      if (step.norm() < 1e-7) break;
    }
    const double cap = 4.0 * std::max(judge_.settings().allowed_gap_deviation, 1e-9);
    for (const Row& row : rows_of(points, fit.offset, hints))
      fit.cost += std::min(cap, row.residual.norm());
    fit.cost /= static_cast<double>(points.size());
    return fit;
  }

  /// Unit directions that no closest point's normal sees.
  std::vector<Vec3> unseen(const Vec3& offset) const {
    const Points points = sampled(points_, kSamples);
    Mat3 sum = Mat3::Zero();
    std::uint32_t hint = 0;
    for (const auto& point : points) {
      const ClosestPoint closest = judge_.tree().closest(point.tip + offset, hint);
      hint = closest.triangle;
      sum += closest.normal * closest.normal.transpose();
    }
    const Eigen::SelfAdjointEigenSolver<Mat3> eigen(sum / static_cast<double>(points.size()));
    std::vector<Vec3> out;
    for (int k = 0; k < 3; ++k) {
      if (eigen.eigenvalues()[k] > kSeen) continue;
      Vec3 direction = eigen.eigenvectors().col(k);
      int largest = 0;
      direction.cwiseAbs().maxCoeff(&largest);
      if (direction[largest] < 0.0) direction = -direction;
      out.push_back(direction);
    }
    return out;
  }

 private:
  struct Equations {
    Mat3 matrix = Mat3::Zero();
    Vec3 right = Vec3::Zero();
  };

  /// tip − (closest point + nominal · normal) of a point; along the normal alone when its foot is
  /// inside the mesh.
  struct Row {
    Vec3 residual;
    Vec3 normal;
    bool boundary;
  };

  std::vector<Row> rows_of(const Points& points, const Vec3& offset,
                           std::vector<std::uint32_t>& hints) const {
    std::vector<Row> rows(points.size());
    std::size_t facing_away = 0;
    for (std::size_t i = 0; i < points.size(); ++i) {
      const Vec3 tip = points[i].tip + offset;
      const ClosestPoint closest = judge_.tree().closest(tip, hints[i]);
      hints[i] = closest.triangle;
      rows[i] = {tip - closest.point, closest.normal, closest.on_boundary};
      facing_away += points[i].axis.dot(closest.normal) < 0.0;
    }
    const bool exchange = judge_.open() && 2 * facing_away > points.size();
    const double gap = judge_.settings().nominal_gap * (exchange ? -1.0 : 1.0);
    for (Row& row : rows) row.residual -= gap * row.normal;
    return rows;
  }

  Equations normal_equations(const Points& points, const Vec3& offset,
                             std::vector<std::uint32_t>& hints) const {
    const std::vector<Row> rows = rows_of(points, offset, hints);
    std::vector<double> sizes;
    for (const Row& row : rows) sizes.push_back(row.residual.norm());
    // Huber's weight at the median: half of the points pull with their full residual.
    auto ordered = sizes;
    const auto middle = ordered.begin() + static_cast<std::ptrdiff_t>(ordered.size() / 2);
    std::nth_element(ordered.begin(), middle, ordered.end());
    const double scale = std::max(*middle, 1e-6);
    Equations out;
    for (std::size_t i = 0; i < rows.size(); ++i) {
      const double weight = std::min(1.0, scale / std::max(sizes[i], 1e-12));
      const Mat3 pull = rows[i].boundary ? Mat3(Mat3::Identity())
                                         : Mat3(rows[i].normal * rows[i].normal.transpose());
      out.matrix += weight * pull;
      out.right -= weight * pull * rows[i].residual;
    }
    out.matrix /= static_cast<double>(rows.size());
    out.right /= static_cast<double>(rows.size());
    return out;
  }

  /// Smallest step that solves the equations in the directions that they see.
  static Vec3 solve(const Equations& equations) {
    const Eigen::SelfAdjointEigenSolver<Mat3> eigen(equations.matrix);
    const double least = kSeen * std::max(eigen.eigenvalues()[2], 1e-300);
    Vec3 step = Vec3::Zero();
    for (int k = 0; k < 3; ++k) {
      const Vec3 direction = eigen.eigenvectors().col(k);
      if (eigen.eigenvalues()[k] > least)
        step += direction * direction.dot(equations.right) / eigen.eigenvalues()[k];
    }
    return step;
  }

  const Judge& judge_;
  const Points& points_;
};

/// Starts for the shift: 0, and a grid over the shifts that keep the points' box inside the mesh's.
std::vector<Vec3> starts_of_shift(const Points& points, const Judge& judge) {
  Vec3 lo = points.front().tip;
  Vec3 hi = lo;
  for (const auto& point : points) {
    lo = lo.cwiseMin(point.tip);
    hi = hi.cwiseMax(point.tip);
  }
  const auto& settings = judge.settings();
  const Vec3 margin = Vec3::Constant(settings.nominal_gap + settings.allowed_gap_deviation);
  Vec3 from = judge.tree().min() - margin - lo;
  Vec3 to = judge.tree().max() + margin - hi;
  for (int k = 0; k < 3; ++k)
    if (from[k] > to[k]) from[k] = to[k] = 0.5 * (from[k] + to[k]);
  std::vector<Vec3> out{Vec3::Zero()};
  for (int i = 0; i < kGrid * kGrid * kGrid; ++i) {
    const Vec3 share =
        Vec3(i % kGrid, i / kGrid % kGrid, i / (kGrid * kGrid)) / static_cast<double>(kGrid - 1);
    out.push_back(from + share.cwiseProduct(to - from));
  }
  return out;
}

/// The shift after which the points fit, if there is one. `points` are mirrored already when that
/// is tried.
std::optional<Vec3> fitting_shift(const Points& points, const Judge& judge) {
  const ShiftSearch search(judge, points);
  const Points judged = sampled(points, kSamples);
  const auto good = [&](const Vec3& offset) {
    Hypothesis shifted;
    shifted.offset = offset;
    return judge.fits(judge.measure(judged, shifted));
  };
  // From where the program is: the smallest shift is the likeliest.
  const auto here = search.refine(Vec3::Zero(), kFittingSamples, 100);
  if (good(here.offset)) return here.offset;
  std::vector<ShiftSearch::Fit> fits;
  for (const Vec3& start : starts_of_shift(points, judge))
    fits.push_back(search.refine(start, kCoarseSamples, 10));
  std::stable_sort(fits.begin(), fits.end(),
                   [](const auto& a, const auto& b) { return a.cost < b.cost; });
  for (std::size_t i = 0; i < std::min(kRefined, fits.size()); ++i) {
    const auto fit = search.refine(fits[i].offset, kFittingSamples, 40);
    if (good(fit.offset)) return fit.offset;
  }
  return std::nullopt;
}

Points mirrored(const Points& points, int axis) {
  Points out = points;
  Hypothesis mirror;
  mirror.mirror = axis;
  for (auto& point : out) point = moved(point, mirror);
  return out;
}

// ---- sentences
// ---------------------------------------------------------------------------------------

std::string fixed(double value, int digits) {
  std::array<char, 400> buffer;
  const auto end = std::to_chars(buffer.data(), buffer.data() + buffer.size(), value,
                                 std::chars_format::fixed, digits);
  std::string text(buffer.data(), end.ptr);
  if (text.find_first_not_of("-0.") == std::string::npos && text.front() == '-') text.erase(0, 1);
  return text;
}

std::string degree_text(double angle) { return fixed(degrees_from_radians(angle), 1) + " deg"; }

std::string as_tuple(const Vec3& v) {
  return "(" + fixed(v.x(), 3) + ", " + fixed(v.y(), 3) + ", " + fixed(v.z(), 3) + ")";
}

std::string gap_text(const GapStatistics& s, const RegistrationSettings& settings) {
  return std::to_string(s.within) + " of " + std::to_string(s.points) +
         " cutting points at a gap of " + fixed(settings.nominal_gap, 3) + " +- " +
         fixed(settings.allowed_gap_deviation, 3) + " mm (gaps " + fixed(s.min, 3) + " to " +
         fixed(s.max, 3) + " mm)";
}

std::string unseen_text(const std::vector<Vec3>& unseen) {
  if (unseen.empty()) return "";
  std::string text = "; a shift along ";
  for (std::size_t i = 0; i < unseen.size(); ++i) text += (i ? " and " : "") + as_tuple(unseen[i]);
  return text + " cannot be seen on this part";
}

std::string unit_sentence(const PartRegistration& r, const RegistrationSettings& settings) {
  const bool small = r.program_ratio > 1.0;
  std::string text;
  if (r.suspect == UnitSuspect::part)
    text = std::string("the part is 25.4 times too ") + (small ? "large" : "small") +
           " for the program: its STL is in " +
           (small ? "mm but was read as inches" : "inches, read as mm") + ", or was exported so; ";
  else if (r.suspect == UnitSuspect::program)
    text = std::string("the program is 25.4 times too ") + (small ? "small" : "large") +
           " for the part: its lengths are in " +
           (small ? "inches, read as mm" : "mm, read as inches") + " (G20, G21); ";
  else
    text = std::string("the program is 25.4 times too ") + (small ? "small" : "large") +
           " for the part: one of the two is read in the wrong unit; ";
  return text + "with the ratio mended there are " + gap_text(r.explained, settings);
}

std::string shift_text(const PartRegistration& r) {
  return "the program must be moved by " + as_tuple(r.offset) + " mm (" +
         fixed(r.offset.norm(), 3) + " mm) to lie on the part: check the work offset";
}

std::string sentence_of(const PartRegistration& r, const RegistrationSettings& settings) {
  const std::string axis = r.mirror_axis < 0 ? "" : std::string(1, "XYZ"[r.mirror_axis]);
  switch (r.verdict) {
    case RegistrationVerdict::registered:
      return "the program lies on the part: " + gap_text(r.gap, settings) + ", tool axis within " +
             degree_text(r.gap.worst_angle) + " of the surface normal" +
             (r.gap.sides_exchanged
                  ? "; the sheet's triangles face away from the tool, its other side was taken"
                  : "") +
             unseen_text(r.unseen);
    case RegistrationVerdict::outliers:
      return "not every cutting point lies on the part: " + gap_text(r.gap, settings) +
             ", the worst is point " + std::to_string(r.gap.worst + 1) + ", off by " +
             fixed(r.gap.worst_deviation, 3) +
             " mm; largest angle between tool axis and surface normal " +
             degree_text(r.gap.worst_angle) + " at point " +
             std::to_string(r.gap.worst_angle_point + 1) + ", allowed " +
             degree_text(settings.allowed_angle);
    case RegistrationVerdict::unit_ratio:
      return unit_sentence(r, settings);
    case RegistrationVerdict::offset:
      return shift_text(r) + "; then there are " + gap_text(r.explained, settings) + ", now " +
             std::to_string(r.gap.within) + unseen_text(r.unseen);
    case RegistrationVerdict::mirrored:
      return "the program is a mirror image of the part: with " + axis + " changed in sign" +
             (r.offset.norm() > 1e-6 ? " and moved by " + as_tuple(r.offset) + " mm" : "") +
             " there are " + gap_text(r.explained, settings) +
             "; mirror the program in the CAM system, or take the other-hand part";
    case RegistrationVerdict::reversed_triangles:
      return "the part is turned inside out: with the sides of its triangles exchanged there are " +
             gap_text(r.explained, settings) + "; export the STL with its outside outside";
    case RegistrationVerdict::tilted_axes:
      return "the tool tip follows the part but the tool axis does not follow its normal: angle " +
             degree_text(r.gap.median_angle) + " in the middle, " + degree_text(r.gap.worst_angle) +
             " at most (point " + std::to_string(r.gap.worst_angle_point + 1) + "), allowed " +
             degree_text(settings.allowed_angle) + "; check the input machine and its rotary axes";
    case RegistrationVerdict::wrong_part:
      break;
  }
  return "the program does not belong to this part: " + gap_text(r.gap, settings) + ", off by " +
         fixed(r.gap.mean_deviation, 3) + " mm on average and " + fixed(r.gap.worst_deviation, 3) +
         " mm at point " + std::to_string(r.gap.worst + 1) +
         "; no ratio of 25.4, shift or mirror image explains it";
}

// ---- hypotheses
// --------------------------------------------------------------------------------------

class Registration {
 public:
  Registration(const Points& points, const TriangleTree& tree, const RegistrationSettings& settings)
      : points_(points), sample_(sampled(points, kSamples)), judge_(tree, settings) {}

  PartRegistration run() {
    out_.gap = judge_.measure(points_, {});
    if (out_.gap.within == out_.gap.points && out_.gap.angles_within == out_.gap.points)
      out_.verdict = RegistrationVerdict::registered;
    else if (judge_.fits(out_.gap))
      out_.verdict = RegistrationVerdict::outliers;
    else
      explain();
    if (out_.verdict == RegistrationVerdict::registered) set_unseen(points_, Vec3::Zero());
    out_.sentence = sentence_of(out_, judge_.settings());
    return std::move(out_);
  }

 private:
  void explain() {
    const bool gaps_fit =
        static_cast<double>(out_.gap.within) >= kShare * static_cast<double>(out_.gap.points);
    if (try_unit_ratio() || try_mirror() || try_reversed()) return;
    if (gaps_fit)
      out_.verdict = RegistrationVerdict::tilted_axes;
    else if (!try_shift())
      try_mirror_and_shift();
  }

  /// Fits on the sample, then on every point.
  bool explains(const Hypothesis& hypothesis, RegistrationVerdict verdict) {
    if (!judge_.fits(judge_.measure(sample_, hypothesis))) return false;
    const GapStatistics all = judge_.measure(points_, hypothesis);
    if (!judge_.fits(all)) return false;
    out_.explained = all;
    out_.verdict = verdict;
    out_.program_ratio = hypothesis.ratio;
    out_.mirror_axis = hypothesis.mirror;
    out_.offset = hypothesis.offset;
    return true;
  }

  bool try_unit_ratio() {
    for (const double ratio : {kMillimetresPerInch, 1.0 / kMillimetresPerInch}) {
      Hypothesis program;
      program.ratio = ratio;
      Hypothesis part = program;
      part.gap_factor = 1.0 / ratio;
      const bool program_fits = judge_.fits(judge_.measure(sample_, program));
      const bool part_fits = judge_.fits(judge_.measure(sample_, part));
      if (part_fits && !program_fits) {
        if (!explains(part, RegistrationVerdict::unit_ratio)) continue;
      } else if (!program_fits || !explains(program, RegistrationVerdict::unit_ratio)) {
        continue;
      }
      out_.suspect = program_fits && part_fits ? UnitSuspect::either
                     : program_fits            ? UnitSuspect::program
                                               : UnitSuspect::part;
      return true;
    }
    return false;
  }

  bool try_mirror() {
    for (int axis = 0; axis < 3; ++axis) {
      Hypothesis hypothesis;
      hypothesis.mirror = axis;
      if (explains(hypothesis, RegistrationVerdict::mirrored)) return true;
    }
    return false;
  }

  bool try_reversed() {
    if (judge_.open() || judge_.tree().signed_volume() >= 0.0) return false;
    Hypothesis hypothesis;
    hypothesis.flip = true;
    return explains(hypothesis, RegistrationVerdict::reversed_triangles);
  }

  bool try_shift() {
    const auto offset = fitting_shift(points_, judge_);
    if (!offset) return false;
    Hypothesis hypothesis;
    hypothesis.offset = *offset;
    if (!explains(hypothesis, RegistrationVerdict::offset)) return false;
    set_unseen(points_, *offset);
    return true;
  }

  bool try_mirror_and_shift() {
    for (int axis = 0; axis < 3; ++axis) {
      const Points image = mirrored(points_, axis);
      const auto offset = fitting_shift(image, judge_);
      if (!offset) continue;
      Hypothesis hypothesis;
      hypothesis.mirror = axis;
      hypothesis.offset = *offset;
      if (!explains(hypothesis, RegistrationVerdict::mirrored)) continue;
      set_unseen(image, *offset);
      return true;
    }
    return false;
  }

  void set_unseen(const Points& points, const Vec3& offset) {
    out_.unseen = ShiftSearch(judge_, points).unseen(offset);
  }

  const Points& points_;
  const Points sample_;
  const Judge judge_;
  PartRegistration out_;
};

void check_input(const Points& points, const RegistrationSettings& settings) {
  require(!points.empty(), "cutting points to register");
  for (const double value :
       {settings.nominal_gap, settings.allowed_gap_deviation, settings.allowed_angle})
    require(std::isfinite(value) && value >= 0.0, "registration settings finite and not negative");
  for (const auto& point : points) {
    require(point.tip.allFinite(), "finite tool tips");
    require(std::abs(point.axis.norm() - 1.0) <= 1e-6, "unit tool axes");
  }
}

}  // namespace

PartRegistration register_part(const std::vector<CutterLocation>& points, const TriangleTree& tree,
                               const RegistrationSettings& settings) {
  check_input(points, settings);
  return Registration(points, tree, settings).run();
}

GapStatistics measure_gaps(const std::vector<CutterLocation>& points, const TriangleTree& tree,
                           const RegistrationSettings& settings) {
  check_input(points, settings);
  return Judge(tree, settings).measure(points, {});
}

std::string to_string(RegistrationVerdict verdict) {
  switch (verdict) {
    case RegistrationVerdict::registered:
      return "registered";
    case RegistrationVerdict::outliers:
      return "outliers";
    case RegistrationVerdict::unit_ratio:
      return "unit_ratio";
    case RegistrationVerdict::offset:
      return "offset";
    case RegistrationVerdict::mirrored:
      return "mirrored";
    case RegistrationVerdict::reversed_triangles:
      return "reversed_triangles";
    case RegistrationVerdict::tilted_axes:
      return "tilted_axes";
    case RegistrationVerdict::wrong_part:
      break;
  }
  return "wrong_part";
}

std::string registration_code(RegistrationVerdict verdict) {
  switch (verdict) {
    case RegistrationVerdict::registered:
      return "";
    case RegistrationVerdict::outliers:
      return "RG111";
    case RegistrationVerdict::unit_ratio:
      return "RG112";
    case RegistrationVerdict::offset:
      return "RG113";
    case RegistrationVerdict::mirrored:
      return "RG114";
    case RegistrationVerdict::reversed_triangles:
      return "RG115";
    case RegistrationVerdict::tilted_axes:
      return "RG116";
    case RegistrationVerdict::wrong_part:
      break;
  }
  return "RG117";
}

}  // namespace smoothpost
