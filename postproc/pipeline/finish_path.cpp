#include "postproc/pipeline/finish_path.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "kernels/core/process.h"
#include "kernels/core/units.h"
#include "kernels/geometry/offset_body.h"
#include "kernels/geometry/refine_surface.h"
#include "kernels/geometry/slicing.h"
#include "kernels/geometry/surface_normal.h"
#include "kernels/geometry/triangle_tree.h"
#include "kernels/geometry/turn_outwards.h"
#include "postproc/pipeline/contour_pieces.h"
#include "postproc/pipeline/finish_told.h"

namespace smoothpost {

namespace {

constexpr double kNoisy = 0.001;         // mm, of the typical residual: the mesh is a scan
constexpr double kNoisyMost = 0.15;      // mm of noise that are a scan's at most
constexpr double kNoisyShare = 0.6;      // of the residual of two rings that one has in a scan
constexpr double kSagShare = 0.02;       // of the depth, that the stock's sides may be off
constexpr double kLeastStep = 0.2;       // of the step, between samples
constexpr std::size_t kMillStride = 2;   // samples from one look at the mill to the next
constexpr std::size_t kReachStride = 4;  // likewise at the machine
constexpr int kMostHalvings = 6;         // of the way between two samples
constexpr std::array<double, 3> kLeadShares{1.0, 0.5, 0.25};
constexpr std::size_t kMostPoints = 5'000'000;

std::string number(double value, int digits = 3) { return finish_number(value, digits); }

/// The spindle on at the first point, off at the last.
void add_events(const std::string& rpm, ToolPath& path) {
  PathEvent on;
  on.point = 0;
  on.event.name = event_name::kSpindleOn;
  on.event.parameters = {{"rpm", rpm}};
  on.line = on.event.line = 1;
  PathEvent off;
  off.point = path.points.size() - 1;
  off.event.name = event_name::kSpindleOff;
  off.line = off.event.line = path.points.back().line;
  path.events = {on, off};
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
    if (turn_outwards(surface_, *tree_, layers.value()) > 0) {
      auto turned = build_triangle_tree(surface_.mesh);
      if (!turned.ok()) return fail();
      tree_.emplace(std::move(turned.value()));
    }
    choose_normals();
    if (!make_stock()) return fail();
    if (settings_.helical && !add_helix(layers.value())) return fail();
    for (std::size_t k = 0; k < layers.value().size() && !settings_.helical; ++k) {
      if (!add_layer(layers.value()[k], k)) return fail();
      if (!progress_("slice",
                     static_cast<double>(k + 1) / static_cast<double>(layers.value().size())))
        return cancelled();
    }
    add(finish_warnings(settings_, out_.layers, found_, file_));
    if (out_.cuts.empty()) {
      diagnostics_.push_back(finish_message(
          Severity::error, "RG132",
          "nothing to finish between " + number(slices.first) + " and " + number(slices.last) +
              " mm: the part is " + number(report.min.z()) + " to " + number(report.max.z()) +
              " mm high" + (out_.layers.empty() ? "" : ", and nothing of its walls there is left"),
          file_));
      return fail();
    }
    out_.checks = finish_checks(settings_, found_);
    add_events(number(settings_.rpm, 0), out_.path);
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
    return Result<FinishPath>::failure(
        finish_message(Severity::error, "US190", "cancelled", file_));
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
    RefineSettings settings;
    settings.tolerance = std::max(kSagShare * settings_.depth, 3.0 * normals_->settings().noise);
    const OrientedSurface fine = refine_surface(surface_, *normals_, settings);
    auto nominal = build_triangle_tree(fine.mesh);
    add(nominal.diagnostics());
    if (!nominal.ok()) return false;
    fine_.emplace(std::move(nominal.value()));
    mill_.emplace(*fine_, settings_.mill);
    OffsetBody body = offset_body(fine, settings_.depth);
    auto built = build_triangle_tree(body.mesh);
    add(built.diagnostics());
    if (!built.ok()) return false;
    stock_.emplace(std::move(built.value()));
    found_.folded = body.folded.count;
    if (body.folded.count > 0) found_.first_folded = body.folded.triangles.front();
    out_.stock = std::move(body.mesh);
    if (settings_.reach_with) reach_ = settings_.reach_with(out_.stock);
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
      if (settings_.outer_only && contour.depth > 0) {
        ++found_.inner;
        continue;
      }
      found_.open += !contour.closed;
      found_.against += contour.against_mesh;
      layer.length += length(contour);
      for (ContourPiece& piece : pieces_of(contour, layer)) {
        if (settings_.alternate && index % 2 == 1)
          std::reverse(piece.samples.begin(), piece.samples.end());
        if (!add_cuts(std::move(piece), index, layer)) return false;
      }
    }
    out_.layers.push_back(layer);
    return true;
  }

  bool no_helix(double height, const char* why) {
    diagnostics_.push_back(finish_message(Severity::error, "RG139",
                                          "no helix goes round the part at " + number(height) +
                                              " mm: " + why +
                                              ". Choose layers (--direction alternate or same)",
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
      found_.against += slice.contours[0].against_mesh;
      out_.layers.push_back({slice.height, 1, 0, lines.back().length(), {}});
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
    return add_cuts(std::move(piece), 0, out_.layers.front());
  }

  std::vector<ContourPiece> pieces_of(const SliceContour& contour, FinishLayer& layer) {
    const ContourLine line(contour);
    if (line.length() < kShortestPiece) {
      layer.left_out.too_short += line.length();
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
    std::vector<bool> out = places_out(all, h, layer.left_out);
    return split_contour({line, contour.closed, start, h, std::move(out)}, std::move(all),
                         layer.left_out.too_short);
  }

  // Samples that no cut may have, each for the first reason that there is.
  std::vector<bool> places_out(const std::vector<SurfacePoint>& all, double spacing,
                               LeftOut& left_out) const {
    std::vector<bool> out(all.size(), false);
    const auto look = [&](std::size_t stride, double& length, const auto& fits) {
      std::vector<bool> bad(all.size(), false);
      for (std::size_t k = 0; k < all.size() + stride - 1; k += stride) {
        const std::size_t i = std::min(k, all.size() - 1);
        if (out[i] || fits(all[i])) continue;
        // From behind the last place that fits, up to the next one.
        const std::size_t from = i < stride ? 0 : i - stride + 1;
        std::fill(bad.begin() + static_cast<std::ptrdiff_t>(from),
                  bad.begin() + static_cast<std::ptrdiff_t>(std::min(i + stride, all.size())),
                  true);
      }
      for (std::size_t i = 0; i < all.size(); ++i) {
        if (!bad[i] || out[i]) continue;
        out[i] = true;
        if (i + 1 < all.size()) length += spacing;
      }
    };
    look(1, left_out.flat,
         [this](const SurfacePoint& p) { return !too_flat(p, settings_.steepest); });
    look(kMillStride, left_out.buried,
         [this](const SurfacePoint& p) { return !buried(*fine_, p); });
    look(kMillStride, left_out.mill, [this](const SurfacePoint& p) { return has_room(p); });
    if (reach_)
      look(kReachStride, left_out.reach, [this](const SurfacePoint& p) {
        return reach_({p.point, p.normal});
      });
    return out;
  }

  bool has_room(const SurfacePoint& at) const {
    return mill_->room(at) >= -kMillShare * settings_.depth;
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

  /// The lead of one end, as large as the mill has room for; an open piece is shortened there by up
  /// to the smallest one. Nothing: there is no room.
  std::optional<std::vector<SurfacePoint>> lead_at(ContourPiece& piece, bool at_end,
                                                   LeftOut& left_out) const {
    if (!(settings_.lead > 0.0)) return std::vector<SurfacePoint>();
    const double smallest = kLeadShares.back() * settings_.lead;
    const auto most = static_cast<std::size_t>(std::ceil(smallest / settings_.step)) + 2;
    for (std::size_t dropped = 0;; ++dropped) {
      for (const double share : kLeadShares) {
        auto lead = lead_of(piece.samples, share * settings_.lead, settings_.step, at_end);
        if (std::all_of(lead.begin(), lead.end(),
                        [this](const SurfacePoint& p) { return has_room(p); }))
          return lead;
      }
      if (piece.closed || dropped == most || piece.samples.size() < 6) return {};
      const auto& s = piece.samples;
      left_out.mill += at_end ? (s[s.size() - 1].point - s[s.size() - 2].point).norm()
                              : (s[1].point - s[0].point).norm();
      if (at_end)
        piece.samples.pop_back();
      else
        piece.samples.erase(piece.samples.begin());
    }
  }

  static double length_of(const std::vector<SurfacePoint>& samples) {
    double sum = 0.0;
    for (std::size_t i = 1; i < samples.size(); ++i)
      sum += (samples[i].point - samples[i - 1].point).norm();
    return sum;
  }

  // The cut of a piece, or those of its parts.
  bool add_cuts(ContourPiece piece, std::size_t layer, FinishLayer& told_in) {
    std::vector<ContourPiece> open;
    open.push_back(std::move(piece));
    while (!open.empty()) {
      ContourPiece now = std::move(open.back());
      open.pop_back();
      ContourPiece whole = now;
      if (now.closed) {
        // Over the start once more.
        const auto again = std::min(now.samples.size() - 1,
                                    static_cast<std::size_t>(settings_.overlap / settings_.step));
        for (std::size_t i = 1; i <= again; ++i) now.samples.push_back(now.samples[i]);
      }
      const auto lead = lead_at(now, false, told_in.left_out);
      const auto away = lead_at(now, true, told_in.left_out);
      if (!lead || !away) {
        told_in.left_out.mill += length_of(now.samples);
        continue;
      }
      std::vector<SurfacePoint> samples = *lead;
      samples.insert(samples.end(), now.samples.begin(), now.samples.end());
      samples.insert(samples.end(), away->begin(), away->end());
      samples = apart(samples);
      if (samples.size() < 2) continue;
      if (out_.path.points.size() + samples.size() > kMostPoints) {
        diagnostics_.push_back(finish_message(
            Severity::error, "RG138",
            "more than " + std::to_string(kMostPoints) + " path points: choose a larger pitch",
            file_));
        return false;
      }
      auto cut =
          smooth_cut(samples, {settings_.tip_tolerance, settings_.axis_tolerance, settings_.step});
      if (!cut && settings_.helical) return no_curve(samples[samples.size() / 2].point);
      if (!cut) {
        part_where_sharp(std::move(whole), open, told_in.left_out);
        continue;
      }
      cut->layer = layer;
      cut->closed = now.closed;
      add_points(samples, *cut);
      out_.cuts.push_back(std::move(*cut));
      ++told_in.cuts;
    }
    return true;
  }

  // The second part of a piece goes onto `open` before the first, which is to be cut first.
  void part_where_sharp(ContourPiece piece, std::vector<ContourPiece>& open, LeftOut& left_out) {
    const auto at = sharpest(piece.samples);
    const double length = length_of(piece.samples);
    if (!at || length < 2.0 * kShortestPiece) {
      left_out.rough += length;
      return;
    }
    ++found_.parted;
    std::vector<SurfacePoint>& s = piece.samples;
    const auto middle = static_cast<std::ptrdiff_t>(*at);
    if (piece.closed) {
      // Opened there: no edge, but no smooth curve either.
      s.pop_back();
      std::rotate(s.begin(), s.begin() + middle, s.end());
      open.push_back({std::move(s), false});
      return;
    }
    ContourPiece second{{s.begin() + middle, s.end()}, false};
    s.resize(*at);
    for (ContourPiece* part : {&second, &piece}) {
      const double way = length_of(part->samples);
      if (way < kShortestPiece)
        left_out.rough += way;
      else
        open.push_back(std::move(*part));
    }
  }

  bool no_curve(const Vec3& at) {
    diagnostics_.push_back(finish_message(
        Severity::error, "RG133",
        "the contour at " + number(at.x()) + ", " + number(at.y()) + ", " + number(at.z()) +
            " mm cannot be smoothed within " + number(settings_.tip_tolerance, 4) + " mm and " +
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
      measure(samples[i], cut.location(cut.s[i]), i % kMillStride == 0);
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

  // What smoothing has done to a sample, how deep it lies in the stock, and the mill in the part.
  void measure(const SurfacePoint& sample, const LocationJet& at, bool with_mill) {
    const Vec3 tip = at.tip.col(0), axis = at.axis.col(0);
    found_.moved = std::max(found_.moved, (tip - sample.point).norm());
    found_.turned = std::max(found_.turned, angle_between(axis, sample.normal));
    if (with_mill) found_.room = std::min(found_.room, mill_->room({tip, axis, false}));
    if (sample.on_contour) found_.depth.add(depth_in(*stock_, tip, axis));
  }

  const FinishSettings& settings_;
  const std::string& file_;
  const Progress& progress_;
  OrientedSurface surface_;
  std::optional<TriangleTree> tree_, fine_, stock_;
  std::optional<MillFit> mill_;  // on fine_
  ReachTest reach_;
  std::optional<SurfaceNormals> normals_;
  std::uint32_t hint_ = 0;
  std::optional<Vec3> seam_;
  FinishFindings found_;
  Diagnostics diagnostics_;
  FinishPath out_;
};

}  // namespace

Result<FinishPath> make_finish_path(const TriangleMesh& part, const FinishSettings& settings,
                                    const std::string& file_name, const Progress& progress) {
  return FinishPlanner(part, settings, file_name, progress).run();
}

}  // namespace smoothpost
