#include "postproc/report/report_plots.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "kernels/core/units.h"
#include "postproc/report/domain_plots.h"
#include "postproc/report/html_text.h"
#include "postproc/report/svg_plot.h"

namespace smoothpost {

namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
constexpr std::size_t kMostBands = 400;

struct OrderWords {
  const char* name;
  const char* per;  // behind the axis' unit
};
constexpr OrderWords kOrders[] = {
    {"position", ""}, {"velocity", "/s"}, {"acceleration", "/s\xC2\xB2"}, {"jerk", "/s\xC2\xB3"}};

bool is_rotary(const AxisDefinition& axis) { return axis.joint.kind == JointKind::rotary; }

/// Only what a file name may hold; an axis' name is the user's.
std::string file_word(const std::string& text) {
  std::string out;
  for (const char c : text)
    out += (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '-'
               ? c
               : '_';
  return out;
}

class PlotMaker {
 public:
  explicit PlotMaker(const PlotData& data) : d_(data), machine_(*data.in.machine) { find_bands(); }

  std::vector<NamedPlot> run() {
    add_feed();
    for (std::size_t j = 0; j < machine_.axes.size(); ++j) add_axis(j);
    add_deviation();
    add_jerk();
    add_rotary();
    add_views();
    return std::move(out_);
  }

 private:
  void add(std::string name, std::string group, std::string caption, std::string text) {
    out_.push_back({std::move(name), std::move(group), std::move(caption), std::move(text)});
  }

  /// Links: what is not cutting.
  void find_bands() {
    const auto& time = d_.after.time;
    std::size_t start = 0;
    for (std::size_t i = 0; i <= time.size(); ++i) {
      const bool link = i < time.size() && !d_.after.cutting[i];
      if (link && (i == 0 || d_.after.cutting[i - 1])) start = i;
      if (!link && i > 0 && !d_.after.cutting[i - 1]) bands_.emplace_back(time[start], time[i - 1]);
    }
    if (bands_.size() > kMostBands) bands_.clear();
  }

  void add_axis(std::size_t j) {
    const AxisDefinition& axis = machine_.axes[j];
    const std::string unit = is_rotary(axis) ? "deg" : "mm";
    const double scale = is_rotary(axis) ? kDegreesPerRadian : 1.0;
    const double bounds[] = {0.0, scale * axis.velocity, scale * axis.acceleration,
                             scale * axis.jerk};
    for (int order = 0; order < d_.after.orders; ++order) {
      const auto o = static_cast<std::size_t>(order);
      const OrderWords& words = kOrders[o];
      Plot plot;
      plot.title = axis.name + " " + words.name;
      plot.x_label = "time, s";
      plot.y_label = unit + words.per;
      plot.of_time = true;
      plot.bands = bands_;
      if (!d_.before.empty())
        plot.curves.push_back({"input", Ink::before, d_.before.time, d_.before.axes[o][j]});
      plot.curves.push_back(
          {d_.before.empty() ? "" : "program", Ink::after, d_.after.time, d_.after.axes[o][j]});
      if (order == 0)
        plot.limits = {{scale * axis.joint.upper, "upper limit"},
                       {scale * axis.joint.lower, "lower limit"}};
      else
        plot.limits = {{bounds[o], "limit"}, {-bounds[o], "limit"}};
      plot.limits_of_size = order > 0;
      clip_before(plot, bounds[o]);
      clip_links(plot);
      add("axis_" + file_word(axis.name) + "_" + words.name, "axis_" + axis.name, "", svg(plot));
    }
  }

  /// Differences of an input with corners may be a hundred times the limit: then the picture ends
  /// at twice the limit, and says so.
  void clip_before(Plot& plot, double limit) const {
    if (d_.before.empty() || !(limit > 0.0)) return;
    PlotCurve& before = plot.curves.front();
    const PlotCurve& after = plot.curves.back();
    double most = 2.0 * limit;
    for (const double v : after.y)
      if (std::isfinite(v)) most = std::max(most, 1.2 * std::abs(v));
    double beyond = 0.0;
    for (double& v : before.y) {
      if (!(std::abs(v) > most)) continue;
      beyond = std::max(beyond, std::abs(v));
      v = std::copysign(most, v);
    }
    if (beyond > 0.0) plot.title += " (input cut off, it reaches " + short_number(beyond, 2) + ")";
  }

  /// The picture is made for the cuts: links may leave it.
  void clip_links(Plot& plot) const {
    double low = INFINITY, high = -INFINITY;
    for (const PlotCurve& c : plot.curves)
      for (std::size_t i = 0; i < c.y.size(); ++i) {
        if (&c == &plot.curves.back() && !d_.after.cutting[i]) continue;
        if (!std::isfinite(c.y[i])) continue;
        low = std::min(low, c.y[i]);
        high = std::max(high, c.y[i]);
      }
    if (!(low <= high)) return;
    const double room = std::max(0.1 * (high - low), 1e-6);
    for (double& v : plot.curves.back().y) v = std::clamp(v, low - room, high + room);
  }

  void add_feed() {
    if (d_.after.empty()) return;
    Plot plot;
    plot.title = "Speed of the tool tip";
    plot.x_label = "time, s";
    plot.y_label = "mm/min";
    plot.of_time = true;
    plot.bands = bands_;
    PlotCurve programmed{"programmed feed", Ink::before, d_.after.time, d_.after.programmed_speed};
    PlotCurve tip{"program", Ink::after, d_.after.time, d_.after.tip_speed};
    bool any = false;
    double most = 0.0;
    for (std::size_t i = 0; i < tip.y.size(); ++i) {
      programmed.y[i] *= kSecondsPerMinute;
      tip.y[i] *= kSecondsPerMinute;
      any = any || std::isfinite(programmed.y[i]);
      if (d_.after.cutting[i]) most = std::max(most, tip.y[i]);
      if (std::isfinite(programmed.y[i])) most = std::max(most, programmed.y[i]);
    }
    // Rapids would make the cuts a line at the bottom.
    if (most > 0.0)
      for (double& v : tip.y) v = std::min(v, 1.25 * most);
    if (any) plot.curves.push_back(std::move(programmed));
    plot.curves.push_back(std::move(tip));
    add("tip_speed", "feed", "Links between cuts are grey; their speed is cut off at the top.",
        svg(plot));
  }

  /// Way of the tip over the cuts, at every point.
  void add_deviation() {
    PlotCurve tip{"", Ink::after, {}, {}}, axis{"", Ink::after, {}, {}};
    double way = 0.0;
    const ProgramPoint* last = nullptr;
    std::vector<PlotMark> tip_marks, axis_marks;
    for (const ProgramPoint& p : d_.motion.points) {
      if (last && p.deviation && last->deviation) way += (p.tip - last->tip).norm();
      if (p.deviation) {
        tip.x.push_back(way);
        tip.y.push_back(p.deviation->norm());
        axis.x.push_back(way);
        axis.y.push_back(degrees_from_radians(p.axis_deviation));
      } else if (!tip.y.empty()) {
        tip.x.push_back(way);
        tip.y.push_back(kNaN);
        axis.x.push_back(way);
        axis.y.push_back(kNaN);
      }
      last = &p;
    }
    if (tip.y.empty()) return;
    const auto mark = [](const PlotCurve& c, std::vector<PlotMark>& marks) {
      std::size_t worst = 0;
      for (std::size_t i = 1; i < c.y.size(); ++i)
        if (c.y[i] > c.y[worst] || std::isnan(c.y[worst])) worst = i;
      marks.push_back({c.x[worst], c.y[worst], short_number(c.y[worst], 3)});
    };
    mark(tip, tip_marks);
    mark(axis, axis_marks);
    const std::string caption =
        "At the ends of blocks and between them, against the input at equal path parameter. The "
        "check also bounds what lies between samples, so its value is a little larger.";
    add_deviation_plot("deviation_tip", "Deviation of the tool tip", "mm", std::move(tip),
                       std::move(tip_marks), machine_.tolerance.tip, caption);
    const bool judged = has_check("axis_deviation");
    add_deviation_plot("deviation_axis", "Deviation of the tool axis", "deg", std::move(axis),
                       std::move(axis_marks),
                       judged ? degrees_from_radians(machine_.tolerance.axis) : 0.0,
                       judged ? ""
                              : "The axis may leave the programmed one by its lead and tilt; the "
                                "checks judge those.");
  }

  void add_deviation_plot(const char* name, const char* title, const char* unit, PlotCurve curve,
                          std::vector<PlotMark> marks, double limit, std::string caption) {
    Plot plot;
    plot.title = title;
    plot.x_label = "way of the tip over all cuts, mm";
    plot.y_label = unit;
    plot.curves.push_back(std::move(curve));
    plot.marks = std::move(marks);
    if (limit > 0.0) plot.limits.push_back({limit, "tolerance"});
    add(name, "deviation", std::move(caption), svg(plot));
  }

  bool has_check(const std::string& name) const {
    const auto& checks = d_.in.conversion.checks;
    return std::any_of(checks.begin(), checks.end(),
                       [&](const Check& c) { return c.name == name; });
  }

  void add_jerk() {
    if (d_.after.orders < 4) return;
    std::vector<BoxGroup> groups;
    for (std::size_t j = 0; j < machine_.axes.size(); ++j) {
      const AxisDefinition& axis = machine_.axes[j];
      BoxGroup group;
      const double scale = is_rotary(axis) ? kDegreesPerRadian : 1.0;
      group.name = axis.name + ", " + (is_rotary(axis) ? "deg" : "mm") + "/s\xC2\xB3";
      group.limit = scale * axis.jerk;
      if (!d_.before.empty())
        group.boxes.push_back(box_of("input at its feed", Ink::before, sizes(d_.before, j)));
      group.boxes.push_back(box_of("program", Ink::after, sizes(d_.after, j)));
      groups.push_back(std::move(group));
    }
    std::string caption =
        "Quartiles and largest value of the size of the jerk in equal times of the cuts.";
    if (!d_.before.empty())
      caption += " The input's is by differences of " + short_number(1000.0 * d_.before.step, 3) +
                 " ms: where it has corners the true jerk has no bound.";
    add("jerk_distribution", "jerk", caption,
        svg_boxes("Distribution of the jerk of every axis", "size of the jerk", groups));
  }

  static std::vector<double> sizes(const MotionRecord& record, std::size_t axis) {
    std::vector<double> out;
    const auto& values = record.axes[MotionRecord::jerk][axis];
    for (std::size_t i = 0; i < values.size(); ++i)
      if (record.cutting[i] && std::isfinite(values[i])) out.push_back(std::abs(values[i]));
    return out;
  }

  void add_rotary() {
    std::vector<std::size_t> rotary;
    for (std::size_t j = 0; j < machine_.axes.size(); ++j)
      if (is_rotary(machine_.axes[j])) rotary.push_back(j);
    for (std::size_t k = rotary.size() > 3 ? rotary.size() - 3 : 0; k + 1 < rotary.size(); ++k) {
      const std::size_t a = rotary[k], b = rotary[k + 1];
      Plot plot;
      plot.title =
          "Path of the rotary axes " + machine_.axes[a].name + " and " + machine_.axes[b].name;
      plot.x_label = machine_.axes[a].name + ", deg";
      plot.y_label = machine_.axes[b].name + ", deg";
      plot.height = 340.0;
      plot.of_function = false;
      if (!d_.before.empty())
        plot.curves.push_back({"input", Ink::before, d_.before.axes[0][a], d_.before.axes[0][b]});
      PlotCurve path{d_.before.empty() ? "" : "program", Ink::after, {}, {}};
      for (std::size_t i = 0; i < d_.after.time.size(); ++i) {
        path.x.push_back(d_.after.axes[0][a][i]);
        path.y.push_back(d_.after.cutting[i] ? d_.after.axes[0][b][i] : kNaN);
      }
      plot.curves.push_back(std::move(path));
      add("rotary_" + file_word(machine_.axes[a].name) + "_" + file_word(machine_.axes[b].name),
          "rotary", "", svg(plot));
    }
  }

  void add_views() {
    add_view("path_top", "From above", 0, 1);
    add_view("path_front", "From the front", 0, 2);
  }

  void add_view(const char* name, const char* title, int a, int b) {
    static constexpr const char* kNames[] = {"X", "Y", "Z"};
    Plot plot;
    plot.title = std::string(title) + ", in the part's coordinates";
    plot.x_label = std::string(kNames[a]) + ", mm";
    plot.y_label = std::string(kNames[b]) + ", mm";
    plot.height = 420.0;
    plot.of_function = false;
    plot.equal_scales = true;
    if (d_.reference) {
      PlotCurve input{"input", Ink::before, {}, {}};
      const auto& points = d_.reference->path().points;
      for (const PathPoint& p : points) {
        input.x.push_back(p.location.tip[a]);
        input.y.push_back(p.replanned || p.kind == MotionKind::rapid ? kNaN : p.location.tip[b]);
      }
      plot.curves.push_back(std::move(input));
    }
    PlotCurve path{"program", Ink::after, {}, {}};
    for (const ProgramPoint& p : d_.motion.points) {
      path.x.push_back(p.tip[a]);
      path.y.push_back(p.link ? kNaN : p.tip[b]);
    }
    if (!path.x.empty()) plot.curves.push_back(std::move(path));
    if (plot.curves.empty()) return;
    add_worst(plot, a, b);
    add(name, "path", "", svg(plot));
  }

  void add_worst(Plot& plot, int a, int b) const {
    for (const Check& c : d_.in.conversion.checks) {
      if (c.output_line == 0 || (c.ok && c.name != "tip_deviation")) continue;
      const auto at = std::lower_bound(
          d_.motion.points.begin(), d_.motion.points.end(), c.output_line,
          [](const ProgramPoint& p, std::uint32_t line) { return p.output_line < line; });
      if (at != d_.motion.points.end() && plot.marks.size() < 6)
        plot.marks.push_back({at->tip[a], at->tip[b], c.name});
    }
  }

  const PlotData& d_;
  const MachineDefinition& machine_;
  std::vector<std::pair<double, double>> bands_;
  std::vector<NamedPlot> out_;
};

}  // namespace

double largest(const MotionRecord& record, MotionRecord::Order order, std::size_t axis) {
  double most = kNaN;
  if (static_cast<int>(order) >= record.orders) return most;
  for (const double v : record.axes[order][axis])
    if (std::isfinite(v) && !(std::abs(v) <= most)) most = std::abs(v);
  return most;
}

std::vector<NamedPlot> report_plots(const PlotData& data) {
  std::vector<NamedPlot> out;
  if (data.in.machine) out = PlotMaker(data).run();
  for (auto& plot : domain_plots(data.in.report)) out.push_back(std::move(plot));
  return out;
}

}  // namespace smoothpost
