#include "postproc/pipeline/finish_path.h"

#include <algorithm>
#include <cmath>

#include "kernels/core/process.h"
#include "kernels/core/units.h"
#include "kernels/geometry/offset_body.h"
#include "kernels/geometry/slicing.h"
#include "kernels/geometry/surface_normal.h"
#include "kernels/geometry/triangle_tree.h"
#include "kernels/optimise/tip_fit.h"
#include "postproc/pipeline/contour_pieces.h"

namespace smoothpost {

namespace {

constexpr double kNoisy = 0.001;     // mm, of the typical residual: the mesh is a scan
constexpr double kNoisyMost = 0.15;  // mm of noise that are a scan's at most
constexpr double kNoisyShare = 0.6;  // of the residual of two rings that one has in a scan
constexpr double kDepthShare = 0.1;  // of the depth, that it may be off
constexpr double kLeastStep = 0.2;   // of the step, between samples
constexpr int kMostHalvings = 6;     // of the way between two samples
constexpr std::size_t kMostPoints = 5'000'000;

std::string number(double value, int digits = 3) {
  double scale = 1.0;
  for (int i = 0; i < digits; ++i) scale *= 10.0;
  std::string text = std::to_string(std::round(value * scale) / scale);
  while (text.back() == '0') text.pop_back();
  if (text.back() == '.') text.pop_back();
  return text;
}

Diagnostic told(Severity severity, const char* code, std::string text, const std::string& file) {
  Diagnostic d;
  d.severity = severity;
  d.code = code;
  d.text = std::move(text);
  d.where.file = file;
  return d;
}

class FinishPlanner {
 public:
  FinishPlanner(const TriangleMesh& part, const FinishSettings& settings, const std::string& file,
                const Progress& progress)
      : settings_(settings), file_(file), progress_(progress), surface_(orient_surface(part)) {}

  Result<FinishPath> run() {
    const MeshReport report = describe(surface_.mesh);
    auto built = build_triangle_tree(surface_.mesh);
    diagnostics_ = built.diagnostics();
    if (!built.ok()) return fail();
    tree_.emplace(std::move(built.value()));
    SliceSettings slices;
    slices.pitch = settings_.pitch;
    slices.first = settings_.from.value_or(report.min.z() + 0.5 * settings_.pitch);
    slices.last = settings_.to.value_or(report.max.z());
    auto layers = slice_surface(surface_, slices);
    add(layers.diagnostics());
    if (!layers.ok()) return fail();
    choose_normals();
    if (!make_stock()) return fail();
    if (settings_.helical && !add_helix(layers.value())) return fail();
    for (std::size_t k = 0; k < layers.value().size() && !settings_.helical; ++k) {
      if (!add_layer(layers.value()[k], k)) return fail();
      if (!progress_("slice",
                     static_cast<double>(k + 1) / static_cast<double>(layers.value().size())))
        return cancelled();
    }
    if (out_.cuts.empty()) {
      diagnostics_.push_back(
          told(Severity::error, "RG132",
               "nothing to finish between " + number(slices.first) + " and " + number(slices.last) +
                   " mm: the part is " + number(report.min.z()) + " to " + number(report.max.z()) +
                   " mm high" +
                   (out_.layers.empty() ? "" : ", and its walls there are too flat or too short"),
               file_));
      return fail();
    }
    tell();
    add_checks();
    add_events();
    return Result<FinishPath>(std::move(out_), std::move(diagnostics_));
  }

 private:
  void add(const Diagnostics& more) {
    for (Diagnostic d : more) {
      if (d.where.file.empty()) d.where.file = file_;
      diagnostics_.push_back(std::move(d));
    }
  }
  Result<FinishPath> fail() { return Result<FinishPath>::failure(std::move(diagnostics_)); }
  Result<FinishPath> cancelled() {
    return Result<FinishPath>::failure(told(Severity::error, "US190", "cancelled", file_));
  }

  // Of a scan two rings are fitted, and residuals of its noise are no reason not to.
  void choose_normals() {
    normals_.emplace(surface_);
    const double residual = normals_->typical_residual(2);
    if (residual < kNoisy || residual > kNoisyMost) return;
    if (normals_->typical_residual(1) < kNoisyShare * residual) return;
    SurfaceNormalSettings noisy;
    noisy.rings = 2;
    noisy.noise = residual;
    normals_.emplace(surface_, noisy);
  }

  bool make_stock() {
    OffsetBody body = offset_body(surface_, settings_.depth);
    auto built = build_triangle_tree(body.mesh);
    add(built.diagnostics());
    if (!built.ok()) return false;
    stock_.emplace(std::move(built.value()));
    if (body.folded.count > 0)
      diagnostics_.push_back(
          told(Severity::warning, "RG135",
               "the stock " + number(settings_.depth) + " mm outside the part folds at " +
                   std::to_string(body.folded.count) + " triangles, first at triangle " +
                   std::to_string(body.folded.triangles.front() + 1) +
                   ": the part is too hollow there for that depth. The depth of cut is measured "
                   "in the stock as it is",
               file_));
    out_.stock = std::move(body.mesh);
    return true;
  }

  // The surface's own point and outward normal at a place of a contour; `right` of its direction.
  SurfacePoint sample_at(const Vec3& at, const Vec3& direction) {
    const ClosestPoint near = tree_->closest(at, hint_);
    hint_ = near.triangle;
    const SurfaceSample found = normals_->at(near.triangle, near.point);
    ++out_.samples;
    out_.fitted += found.source == SurfaceSample::Source::quadric;
    SurfacePoint sample;
    sample.point = found.point;
    const Vec3 right(direction.y(), -direction.x(), 0.0);
    sample.normal = found.normal.dot(right) < 0.0 ? Vec3(-found.normal) : found.normal;
    return sample;
  }

  bool add_layer(const SliceLayer& slice, std::size_t index) {
    FinishLayer layer;
    layer.height = slice.height;
    layer.contours = slice.contours.size();
    for (const SliceContour& contour : slice.contours) {
      open_ += !contour.closed;
      against_ += contour.against_mesh;
      layer.length += length(contour);
      for (ContourPiece& piece : pieces_of(contour, layer)) {
        if (settings_.alternate && index % 2 == 1)
          std::reverse(piece.samples.begin(), piece.samples.end());
        if (!add_cut(std::move(piece), index)) return false;
        ++layer.cuts;
      }
    }
    out_.layers.push_back(layer);
    return true;
  }

  bool no_helix(double height, const char* why) {
    diagnostics_.push_back(told(Severity::error, "RG139",
                                "no helix goes round the part at " + number(height) + " mm: " +
                                    why + ". Choose layers (--direction alternate or same)",
                                file_));
    return false;
  }

  bool add_helix(const std::vector<SliceLayer>& slices) {
    std::vector<ContourLine> lines;
    std::vector<double> starts;
    for (const SliceLayer& slice : slices) {
      if (slice.contours.size() != 1 || !slice.contours[0].closed)
        return no_helix(slice.height, "there is not one closed contour");
      lines.emplace_back(slice.contours[0]);
      starts.push_back(seam(lines.back()));
      against_ += slice.contours[0].against_mesh;
      out_.layers.push_back({slice.height, 1, 0, lines.back().length(), 0.0});
    }
    if (slices.empty()) return true;
    ContourPiece piece;
    // Once round the first layer, a climb from each to the next, once round the last.
    for (std::size_t turn = 0; turn <= lines.size(); ++turn) {
      const std::size_t a = turn == 0 ? 0 : turn - 1;
      const std::size_t b = std::min(turn, lines.size() - 1);
      const auto count = static_cast<std::size_t>(std::ceil(lines[a].length() / settings_.step));
      for (std::size_t i = turn == 0 ? 0 : 1; i <= count; ++i) {
        const double share = static_cast<double>(i) / static_cast<double>(count);
        const auto place = [&](std::size_t k) {
          return std::fmod(starts[k] + share * lines[k].length(), lines[k].length());
        };
        const Vec3 at = (1.0 - share) * lines[a].at(place(a)) + share * lines[b].at(place(b));
        piece.samples.push_back(sample_at(at, lines[a].direction(place(a))));
        const SurfacePoint& now = piece.samples.back();
        if (too_flat(now, settings_.steepest))
          return no_helix(at.z(), "its wall is too flat there");
        if (piece.samples.size() > 1 &&
            angle_between(piece.samples[piece.samples.size() - 2].normal, now.normal) > kCornerTurn)
          return no_helix(at.z(), "it has an edge there");
      }
    }
    out_.layers.front().cuts = 1;
    return add_cut(std::move(piece), 0);
  }

  std::vector<ContourPiece> pieces_of(const SliceContour& contour, FinishLayer& layer) {
    const ContourLine line(contour);
    if (line.length() < kShortestPiece) {
      layer.left_out += line.length();
      return {};
    }
    const double start = contour.closed ? seam(line) : 0.0;
    const auto count = static_cast<std::size_t>(std::ceil(line.length() / settings_.step));
    const double h = line.length() / static_cast<double>(count);
    const auto place = [&](std::size_t i) {
      const double s = start + h * static_cast<double>(i);
      return contour.closed && s > line.length() ? s - line.length() : std::min(s, line.length());
    };
    std::vector<SurfacePoint> all;
    for (std::size_t i = 0; i <= count; ++i) {
      if (contour.closed && i == count) {
        all.push_back(all.front());
        break;
      }
      all.push_back(sample_at(line.at(place(i)), line.direction(place(i))));
    }
    return split_contour({line, contour.closed, start, h, settings_.steepest}, std::move(all),
                         layer.left_out);
  }

  // Where a closed contour starts: next to the start before it.
  double seam(const ContourLine& line) {
    double best = line.middle_of_longest();
    if (seam_) {
      double least = INFINITY;
      const auto count = static_cast<int>(std::ceil(line.length()));
      for (int i = 0; i < count; ++i) {
        const double s = line.length() * i / count;
        const double distance = (line.at(s) - *seam_).head<2>().squaredNorm();
        if (distance < least) {
          least = distance;
          best = s;
        }
      }
    }
    seam_ = line.at(best);
    return best;
  }

  // Without those that lie nearly on the one before: the surface's own points may come together.
  std::vector<SurfacePoint> apart(const std::vector<SurfacePoint>& samples) const {
    std::vector<SurfacePoint> out;
    for (const SurfacePoint& s : samples)
      if (out.empty() || (s.point - out.back().point).norm() >= kLeastStep * settings_.step)
        out.push_back(s);
    return out;
  }

  bool add_cut(ContourPiece piece, std::size_t layer) {
    if (piece.closed) {
      // Over the start once more.
      const auto again = std::min(piece.samples.size() - 1,
                                  static_cast<std::size_t>(settings_.overlap / settings_.step));
      for (std::size_t i = 1; i <= again; ++i) piece.samples.push_back(piece.samples[i]);
    }
    const std::vector<SurfacePoint> samples =
        apart(with_leads(piece.samples, settings_.lead, settings_.step));
    if (samples.size() < 2) return true;
    FinishCut cut;
    cut.layer = layer;
    cut.closed = piece.closed;
    cut.s.push_back(0.0);
    for (std::size_t i = 1; i < samples.size(); ++i) {
      cut.s.push_back(cut.s.back() + (samples[i].point - samples[i - 1].point).norm());
      const Vec3& a = samples[i - 1].normal;
      const Vec3& b = samples[i].normal;
      cut.turning += std::atan2(a.x() * b.y() - a.y() * b.x(), a.x() * b.x() + a.y() * b.y());
    }
    if (out_.path.points.size() + samples.size() > kMostPoints) {
      diagnostics_.push_back(
          told(Severity::error, "RG138",
               "more than " + std::to_string(kMostPoints) + " path points: choose a larger pitch",
               file_));
      return false;
    }
    if (!smooth(samples, cut)) return false;
    add_points(samples, cut);
    out_.cuts.push_back(std::move(cut));
    return true;
  }

  static bool fit(const std::vector<double>& u, std::vector<Vec3> points, int spans,
                  double tolerance, SplineJets<3>& curve) {
    TipFitProblem problem;
    problem.knots = clamped_knots(5, spans);
    problem.u = u;
    problem.points = std::move(points);
    problem.tolerance = tolerance;
    problem.hybrid = false;
    problem.explain = false;
    TipFit found = fit_tip(problem);
    if (found.failed >= 0) return false;
    curve = SplineJets<3>(found.curve);
    return true;
  }

  bool smooth(const std::vector<SurfacePoint>& samples, FinishCut& cut) {
    std::vector<Vec3> points, normals;
    for (const SurfacePoint& s : samples) {
      points.push_back(s.point);
      normals.push_back(s.normal);
    }
    const bool finite = std::all_of(samples.begin(), samples.end(), [](const SurfacePoint& s) {
      return s.point.allFinite() && s.normal.allFinite();
    });
    for (const double piece : {2.0, 1.0, 0.5, 0.25}) {
      if (!finite) break;
      const int spans =
          std::max(6, static_cast<int>(std::ceil(cut.length() / std::max(piece, settings_.step))));
      cut.scale = cut.length() / spans;
      cut.pieces = spans;
      std::vector<double> u;
      for (const double s : cut.s) u.push_back(std::min(s / cut.scale, static_cast<double>(spans)));
      u.back() = spans;
      // The normalised axis is off by no more than the components are.
      if (fit(u, points, spans, settings_.tip_tolerance, cut.tip) &&
          fit(u, normals, spans, 0.98 * settings_.axis_tolerance, cut.axis))
        return true;
    }
    diagnostics_.push_back(told(Severity::error, "RG133",
                                "the contour at " + number(samples[samples.size() / 2].point.x()) +
                                    ", " + number(samples[samples.size() / 2].point.y()) + ", " +
                                    number(samples[samples.size() / 2].point.z()) +
                                    " mm cannot be smoothed within " +
                                    number(settings_.tip_tolerance, 4) + " mm and " +
                                    number(degrees_from_radians(settings_.axis_tolerance)) +
                                    " deg: allow more, or mend the mesh there",
                                file_));
    return false;
  }

  // Places between two so close that straight motion stays near the curves.
  void add_between(const FinishCut& cut, double from, double to, int depth,
                   std::vector<double>& places) const {
    const LocationJet a = cut.location(from), b = cut.location(to);
    const double middle = 0.5 * (from + to);
    const LocationJet m = cut.location(middle);
    const Vec3 tip = 0.5 * (a.tip.col(0) + b.tip.col(0));
    const Vec3 axis = (a.axis.col(0) + b.axis.col(0)).normalized();
    if (depth >= kMostHalvings || ((m.tip.col(0) - tip).norm() <= settings_.chord_tip &&
                                   angle_between(m.axis.col(0), axis) <= settings_.chord_axis))
      return;
    add_between(cut, from, middle, depth + 1, places);
    places.push_back(middle);
    add_between(cut, middle, to, depth + 1, places);
  }

  void add_points(const std::vector<SurfacePoint>& samples, FinishCut& cut) {
    cut.first_point = out_.path.points.size();
    std::vector<double> places;
    for (std::size_t i = 0; i < samples.size(); ++i) {
      if (i > 0) add_between(cut, cut.s[i - 1], cut.s[i], 0, places);
      places.push_back(cut.s[i]);
      measure(samples[i], cut.location(cut.s[i]));
    }
    Vec3 before = Vec3::Zero();
    for (const double s : places) {
      const LocationJet at = cut.location(s);
      const bool first = s == 0.0;
      PathPoint p;
      p.location = {at.tip.col(0), at.axis.col(0)};
      p.kind = first ? MotionKind::rapid : MotionKind::feed;
      p.line = static_cast<std::uint32_t>(out_.path.points.size() + 1);
      p.tool_length = settings_.tool_length;
      if (!first) p.duration = (p.location.tip - before).norm() / settings_.feed;
      before = p.location.tip;
      out_.path.points.push_back(p);
    }
    cut.s = std::move(places);
  }

  // What smoothing has done to a sample, and how deep it lies in the stock.
  void measure(const SurfacePoint& sample, const LocationJet& at) {
    moved_ = std::max(moved_, (at.tip.col(0) - sample.point).norm());
    turned_ = std::max(turned_, angle_between(at.axis.col(0), sample.normal));
    if (!sample.on_contour) return;
    const double depth = -stock_->closest(at.tip.col(0)).signed_distance;
    least_ = std::min(least_, depth);
    greatest_ = std::max(greatest_, depth);
    sum_ += depth;
    ++measured_;
  }

  void tell() {
    double length = 0.0, left_out = 0.0;
    for (const FinishLayer& layer : out_.layers) {
      length += layer.length;
      left_out += layer.left_out;
    }
    const auto warn = [this](const char* code, std::string text) {
      diagnostics_.push_back(told(Severity::warning, code, std::move(text), file_));
    };
    if (left_out > 1e-3)
      warn("RG134", number(left_out, 1) + " of " + number(length, 1) +
                        " mm of contours are left out: their walls are steeper than " +
                        number(degrees_from_radians(settings_.steepest)) +
                        " deg against the machine's reach of the tool axis, or pieces between "
                        "edges are shorter than " +
                        number(kShortestPiece) + " mm");
    if (open_ > 0)
      warn("RG136", std::to_string(open_) +
                        " contours are open: the mesh has holes there, and the body is taken to be "
                        "on the side that its triangles say");
    if (against_ > 0)
      warn("RG137", std::to_string(against_) +
                        " contours have triangles wound the wrong way round: the outside is taken "
                        "from how contours lie in each other");
  }

  void add_checks() {
    Check depth;
    depth.name = "depth_of_cut";
    depth.unit = "mm";
    depth.value = std::max(greatest_ - settings_.depth, settings_.depth - least_);
    depth.limit = kDepthShare * settings_.depth;
    depth.ok = depth.value <= depth.limit;
    depth.planned = true;
    depth.note = "depth of cut along the contours, in the stock: least " + number(least_) +
                 ", mean " +
                 number(sum_ / static_cast<double>(std::max<std::size_t>(measured_, 1))) +
                 ", greatest " + number(greatest_) + " mm; asked for " + number(settings_.depth);
    Check moved;
    moved.name = "contour_deviation";
    moved.unit = "mm";
    moved.value = moved_;
    moved.limit = settings_.tip_tolerance;
    moved.ok = moved_ <= moved.limit * (1.0 + 1e-6);
    moved.planned = true;
    Check turned;
    turned.name = "axis_to_normal";
    turned.unit = "deg";
    turned.value = degrees_from_radians(turned_);
    turned.limit = degrees_from_radians(settings_.axis_tolerance);
    turned.ok = turned_ <= settings_.axis_tolerance * (1.0 + 1e-6);
    turned.planned = true;
    out_.checks = {depth, moved, turned};
  }

  void add_events() {
    PathEvent on;
    on.point = 0;
    on.event.name = event_name::kSpindleOn;
    on.event.parameters = {{"rpm", number(settings_.rpm, 0)}};
    on.line = on.event.line = 1;
    PathEvent off;
    off.point = out_.path.points.size() - 1;
    off.event.name = event_name::kSpindleOff;
    off.line = off.event.line = out_.path.points.back().line;
    out_.path.events = {on, off};
  }

  const FinishSettings& settings_;
  const std::string& file_;
  const Progress& progress_;
  OrientedSurface surface_;
  std::optional<TriangleTree> tree_, stock_;
  std::optional<SurfaceNormals> normals_;
  std::uint32_t hint_ = 0;
  std::optional<Vec3> seam_;
  std::size_t open_ = 0, against_ = 0, measured_ = 0;
  double least_ = INFINITY, greatest_ = -INFINITY, sum_ = 0.0;
  double moved_ = 0.0, turned_ = 0.0;
  Diagnostics diagnostics_;
  FinishPath out_;
};

}  // namespace

LocationJet FinishCut::location(double place) const {
  LocationJet out{tip.jet(place / scale, scale), axis.jet(place / scale, scale)};
  Jet square{};
  for (std::size_t r = 0; r < 4; ++r)
    for (std::size_t k = 0; k <= r; ++k)
      square[r] += kLeibniz[r][k] * out.axis.col(static_cast<Eigen::Index>(k))
                                        .dot(out.axis.col(static_cast<Eigen::Index>(r - k)));
  Jet root{};
  root[0] = std::sqrt(square[0]);
  root[1] = square[1] / (2.0 * root[0]);
  root[2] = (square[2] - 2.0 * root[1] * root[1]) / (2.0 * root[0]);
  root[3] = (square[3] - 6.0 * root[1] * root[2]) / (2.0 * root[0]);
  out.axis = product(reciprocal(root), out.axis);
  return out;
}

Result<FinishPath> make_finish_path(const TriangleMesh& part, const FinishSettings& settings,
                                    const std::string& file_name, const Progress& progress) {
  return FinishPlanner(part, settings, file_name, progress).run();
}

}  // namespace smoothpost
