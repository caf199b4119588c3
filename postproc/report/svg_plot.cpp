#include "postproc/report/svg_plot.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "machines/dialects/decimal.h"
#include "postproc/report/html_text.h"

namespace smoothpost {

namespace {

constexpr double kWidth = 760.0, kLeft = 78.0, kRight = 14.0, kTop = 30.0, kBottom = 36.0;
constexpr double kInner = kWidth - kLeft - kRight;
constexpr double kMostPoints = 6000.0;  // of a curve in the plane
constexpr double kFarLimit = 1.0;       // times the extent of the data

const char* colour(Ink ink) {
  switch (ink) {
    case Ink::after:
      return "#1f4e9c";
    case Ink::before:
      return "#d08a1d";
    case Ink::limit:
      return "#b3202a";
    case Ink::part:
      return "#9aa3af";
    case Ink::mark:
      return "#b3202a";
  }
  return "#000000";
}

std::string fixed(double value, int decimals = 1) {
  std::string text;
  append_decimal(text, std::clamp(value, -1e6, 1e6), decimals);
  return text;
}

/// `name="value"` with a blank before it.
std::string attribute(const char* name, double value) {
  return std::string(" ") + name + "=\"" + fixed(value) + "\"";
}

std::string words(double x, double y, const std::string& text, const std::string& more = {}) {
  return "<text" + attribute("x", x) + attribute("y", y) + more + ">" + escape_html(text) +
         "</text>\n";
}

std::string stroke(double x0, double y0, double x1, double y1, const std::string& ink,
                   const std::string& more = {}) {
  return "<line" + attribute("x1", x0) + attribute("y1", y0) + attribute("x2", x1) +
         attribute("y2", y1) + " stroke=\"" + ink + "\"" + more + "/>\n";
}

std::string opening(double height, const std::string& title, const std::string& more = {}) {
  const std::string h = fixed(height, 0);
  return "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 " + fixed(kWidth, 0) + " " + h +
         "\" width=\"" + fixed(kWidth, 0) + "\" height=\"" + h + "\" role=\"img\" aria-label=\"" +
         escape_html(title) + "\" font-family=\"sans-serif\" font-size=\"12\" fill=\"#1c2430\"" +
         more + ">\n<rect width=\"100%\" height=\"100%\" fill=\"#ffffff\"/>\n" +
         words(kLeft, 16.0, title, " font-weight=\"600\"");
}

struct Range {
  double low = std::numeric_limits<double>::infinity();
  double high = -std::numeric_limits<double>::infinity();
  void see(double v) {
    if (!std::isfinite(v)) return;
    low = std::min(low, v);
    high = std::max(high, v);
  }
  bool empty() const { return !(low <= high); }
  double size() const { return high - low; }
  /// Room around it, or around a single value.
  Range with_room(double share) const {
    if (empty()) return {0.0, 1.0};
    const double least = std::max(1e-9, 1e-6 * std::max(std::abs(low), std::abs(high)));
    const double room = std::max(share * size(), 0.5 * least);
    return {low - room, high + room};
  }
};

/// Even steps of 1, 2 or 5 times a power of ten, about `count` of them.
std::vector<double> ticks(const Range& range, int count) {
  const double raw = range.size() / count;
  const double power = std::pow(10.0, std::floor(std::log10(raw)));
  const double step = power * (raw / power < 1.5   ? 1.0
                               : raw / power < 3.5 ? 2.0
                               : raw / power < 7.5 ? 5.0
                                                   : 10.0);
  std::vector<double> out;
  const double first = std::ceil(range.low / step - 1e-9);
  for (double k = first; k * step <= range.high + 1e-9 * step && out.size() < 20; ++k)
    out.push_back(k * step);
  return out;
}

/// Maps values to the picture.
struct Frame {
  Range x, y;
  double height = 0.0;
  double inner() const { return height - kTop - kBottom; }
  double px(double v) const { return kLeft + kInner * (v - x.low) / x.size(); }
  double py(double v) const { return kTop + inner() * (y.high - v) / y.size(); }
};

bool is_far(const PlotLimit& limit, const Range& data) {
  if (data.empty()) return false;
  const double away = std::max(data.low - limit.value, limit.value - data.high);
  return away > kFarLimit * std::max(data.size(), 1e-3 * std::abs(limit.value));
}

Frame frame_of(const Plot& plot) {
  Range x, y;
  for (const PlotCurve& c : plot.curves) {
    for (std::size_t i = 0; i < std::min(c.x.size(), c.y.size()); ++i) {
      if (!std::isfinite(c.y[i])) continue;
      x.see(c.x[i]);
      y.see(c.y[i]);
    }
  }
  const Range data = y;
  for (const PlotLimit& limit : plot.limits)
    if (!is_far(limit, data)) y.see(limit.value);
  Frame frame{x.with_room(0.0), y.with_room(0.06), plot.height};
  if (plot.equal_scales) {
    const double scale = std::max(frame.x.size() / kInner, frame.y.size() / frame.inner());
    const double cx = 0.5 * (frame.x.low + frame.x.high), cy = 0.5 * (frame.y.low + frame.y.high);
    frame.x = {cx - 0.5 * scale * kInner, cx + 0.5 * scale * kInner};
    frame.y = {cy - 0.5 * scale * frame.inner(), cy + 0.5 * scale * frame.inner()};
  }
  return frame;
}

std::string grid(const Plot& plot, const Frame& f) {
  std::string out;
  const double base = f.height - kBottom;
  for (const double v : ticks(f.y, f.height > 300.0 ? 8 : 4)) {
    out += stroke(kLeft, f.py(v), kWidth - kRight, f.py(v), "#e5e8ed");
    out += words(kLeft - 6.0, f.py(v) + 4.0, short_number(v), " text-anchor=\"end\"");
  }
  for (const double v : ticks(f.x, 8)) {
    out += stroke(f.px(v), base, f.px(v), base + 4.0, "#9aa3af");
    out += words(f.px(v), base + 16.0, short_number(v), " text-anchor=\"middle\"");
  }
  out += "<rect" + attribute("x", kLeft) + attribute("y", kTop) + attribute("width", kInner) +
         attribute("height", f.inner()) + " fill=\"none\" stroke=\"#9aa3af\"/>\n";
  out +=
      words(kWidth - kRight, f.height - 5.0, plot.x_label, " text-anchor=\"end\" fill=\"#5d6877\"");
  out += "<text transform=\"translate(14 " + fixed(kTop + 0.5 * f.inner()) +
         ") rotate(-90)\" text-anchor=\"middle\" fill=\"#5d6877\">" + escape_html(plot.y_label) +
         "</text>\n";
  return out;
}

/// Points as SVG path commands; a pen that is lifted at gaps.
class Pen {
 public:
  void lift() { down_ = false; }
  void to(double x, double y) {
    path_ += down_ ? "L" : "M";
    append_decimal(path_, std::clamp(x, -9999.0, 9999.0), 1);
    path_ += ' ';
    append_decimal(path_, std::clamp(y, -9999.0, 9999.0), 1);
    down_ = true;
  }
  const std::string& path() const { return path_; }

 private:
  std::string path_;
  bool down_ = false;
};

/// One column of pixels: first, least, largest, last value in the order of x.
struct Column {
  double at = 0.0, first = 0.0, low = 0.0, high = 0.0, last = 0.0;
  std::size_t count = 0;
  void see(double y) {
    if (count++ == 0) first = low = high = y;
    low = std::min(low, y);
    high = std::max(high, y);
    last = y;
  }
  void draw(Pen& pen) {
    if (count > 0) pen.to(at, first);
    if (count > 2 && low < high) {
      pen.to(at, low);
      pen.to(at, high);
    }
    if (count > 1 && last != first) pen.to(at, last);
    count = 0;
  }
};

std::string function_path(const PlotCurve& c, const Frame& f) {
  const std::size_t n = std::min(c.x.size(), c.y.size());
  Pen pen;
  const bool all = n < static_cast<std::size_t>(kInner);
  Column column;
  for (std::size_t i = 0; i < n; ++i) {
    if (!std::isfinite(c.y[i])) {
      column.draw(pen);
      pen.lift();
      continue;
    }
    const double x = f.px(c.x[i]), y = f.py(c.y[i]);
    if (all) {
      pen.to(x, y);
      continue;
    }
    if (column.count > 0 && std::floor(x) != std::floor(column.at)) column.draw(pen);
    if (column.count == 0) column.at = x;
    column.see(y);
  }
  column.draw(pen);
  return pen.path();
}

/// Length of a curve in the picture, gaps left out.
double drawn_length(const PlotCurve& c, const Frame& f) {
  double length = 0.0;
  for (std::size_t i = 1; i < std::min(c.x.size(), c.y.size()); ++i)
    if (std::isfinite(c.y[i]) && std::isfinite(c.y[i - 1]))
      length += std::hypot(f.px(c.x[i]) - f.px(c.x[i - 1]), f.py(c.y[i]) - f.py(c.y[i - 1]));
  return length;
}

/// In the plane: points nearer than half a pixel to the one before are left out, more where the
/// curve is so long that there would be more than kMostPoints.
std::string plane_path(const PlotCurve& c, const Frame& f) {
  Pen pen;
  double last_x = -1e9, last_y = -1e9;
  const std::size_t n = std::min(c.x.size(), c.y.size());
  const double least = std::max(0.5, drawn_length(c, f) / kMostPoints);
  for (std::size_t i = 0; i < n; ++i) {
    if (!std::isfinite(c.y[i])) {
      pen.lift();
      last_x = -1e9;
      continue;
    }
    const double x = f.px(c.x[i]), y = f.py(c.y[i]);
    const bool end = i + 1 == n || !std::isfinite(c.y[i + 1]);
    if (!end && std::hypot(x - last_x, y - last_y) < least) continue;
    pen.to(x, y);
    last_x = x;
    last_y = y;
  }
  return pen.path();
}

std::string curves(const Plot& plot, const Frame& f) {
  std::string out;
  for (const PlotCurve& c : plot.curves) {
    const std::string path = plot.of_function ? function_path(c, f) : plane_path(c, f);
    if (path.empty()) continue;
    const bool thin = c.ink == Ink::before || c.ink == Ink::part;
    out += "<path d=\"" + path + "\" fill=\"none\" stroke=\"" + colour(c.ink) +
           "\" stroke-width=\"" + (thin ? "1" : "1.3") + "\" stroke-linejoin=\"round\"/>\n";
  }
  return out;
}

std::string limits(const Plot& plot, const Frame& f) {
  Range data;
  for (const PlotCurve& c : plot.curves)
    for (const double v : c.y) data.see(v);
  std::string out, far;
  for (const PlotLimit& limit : plot.limits) {
    if (!is_far(limit, data)) {
      out += stroke(kLeft, f.py(limit.value), kWidth - kRight, f.py(limit.value), "#b3202a",
                    " stroke-dasharray=\"6 4\"");
      continue;
    }
    if (plot.limits_of_size && limit.value < 0.0) continue;
    far += (far.empty() ? "" : ", ") + limit.name + " " + short_number(limit.value);
    const double reach = std::max(std::abs(data.low), std::abs(data.high));
    if (plot.limits_of_size)
      far += " (" + short_number(100.0 * reach / limit.value, 2) + " % of it in this picture)";
  }
  if (!far.empty())
    out += words(kLeft + 6.0, kTop + 13.0, "beyond: " + far,
                 " font-size=\"11\" fill=\"#b3202a\" paint-order=\"stroke\" stroke=\"#ffffff\" "
                 "stroke-width=\"3\"");
  return out;
}

std::string legend(const Plot& plot) {
  std::string out;
  double x = kWidth - kRight;
  const auto entry = [&](const std::string& name, const char* ink, bool dashed) {
    x -= 6.1 * static_cast<double>(name.size()) + 8.0;
    out += words(x, 16.0, name, " font-size=\"11\" fill=\"#5d6877\"");
    out += stroke(x - 22.0, 12.0, x - 5.0, 12.0, ink,
                  dashed ? " stroke-width=\"2\" stroke-dasharray=\"5 3\"" : " stroke-width=\"2\"");
    x -= 28.0;
  };
  if (!plot.limits.empty()) entry("limit", "#b3202a", true);
  for (auto c = plot.curves.rbegin(); c != plot.curves.rend(); ++c)
    if (!c->name.empty()) entry(c->name, colour(c->ink), false);
  return out;
}

std::string marks(const std::vector<PlotMark>& list, const Frame& f) {
  std::string out;
  for (const PlotMark& m : list) {
    if (!std::isfinite(m.x) || !std::isfinite(m.y)) continue;
    const double x = f.px(m.x), y = f.py(m.y);
    const bool right = x > kLeft + 0.7 * kInner;
    out += "<circle" + attribute("cx", x) + attribute("cy", y) +
           " r=\"4\" fill=\"none\" stroke=\"#b3202a\" stroke-width=\"1.5\"/>\n";
    out += words(
        x + (right ? -7.0 : 7.0), y - 5.0, m.name,
        std::string(" font-size=\"11\" fill=\"#b3202a\"") + (right ? " text-anchor=\"end\"" : ""));
  }
  return out;
}

}  // namespace

std::string svg(const Plot& plot) {
  const Frame f = frame_of(plot);
  std::string more;
  if (plot.of_time)
    more = " class=\"of-time\" data-from=\"" + short_number(f.x.low, 9) + "\" data-to=\"" +
           short_number(f.x.high, 9) + "\" data-left=\"" + fixed(kLeft) + "\" data-right=\"" +
           fixed(kWidth - kRight) + "\"";
  std::string out = opening(plot.height, plot.title, more);
  for (const auto& [from, to] : plot.bands) {
    const double left = std::max(kLeft, f.px(from)), right = std::min(kWidth - kRight, f.px(to));
    if (right - left < 0.3) continue;
    out += "<rect" + attribute("x", left) + attribute("y", kTop) +
           attribute("width", right - left) + attribute("height", f.inner()) +
           " fill=\"#eef0f3\"/>\n";
  }
  out += grid(plot, f) + curves(plot, f) + limits(plot, f) + marks(plot.marks, f) + legend(plot);
  return out + "</svg>\n";
}

PlotBox box_of(std::string name, Ink ink, std::vector<double> sizes) {
  PlotBox box{std::move(name), ink};
  std::erase_if(sizes, [](double v) { return !std::isfinite(v); });
  if (sizes.empty()) return box;
  const auto at = [&](double share) {
    const auto k = static_cast<std::size_t>(share * static_cast<double>(sizes.size() - 1));
    std::nth_element(sizes.begin(), sizes.begin() + static_cast<std::ptrdiff_t>(k), sizes.end());
    return sizes[k];
  };
  box.lower = at(0.25);
  box.median = at(0.5);
  box.upper = at(0.75);
  box.largest = *std::max_element(sizes.begin(), sizes.end());
  return box;
}

std::string svg_boxes(const std::string& title, const std::string& y_label,
                      const std::vector<BoxGroup>& groups) {
  constexpr double kHeight = 380.0, kDecades = 7.0, kBox = 16.0;
  Range y;
  for (const BoxGroup& g : groups) {
    for (const PlotBox& b : g.boxes)
      for (const double v : {b.lower, b.largest})
        if (v > 0.0) y.see(std::log10(v));
    if (g.limit > 0.0) y.see(std::log10(g.limit));
  }
  if (y.empty()) y = {0.0, 1.0};
  y.high = std::ceil(y.high + 0.05);
  y.low = std::max(std::floor(y.low), y.high - kDecades);
  Frame f{{0.0, static_cast<double>(std::max<std::size_t>(groups.size(), 1))}, y, kHeight};
  Plot words_of;
  words_of.y_label = y_label;
  std::string out = opening(kHeight, title);
  for (double power = y.low; power <= y.high; ++power) {
    out += stroke(kLeft, f.py(power), kWidth - kRight, f.py(power), "#e5e8ed");
    out += words(kLeft - 6.0, f.py(power) + 4.0, "1e" + fixed(power, 0), " text-anchor=\"end\"");
  }
  const auto place = [&](double v) {
    return f.py(std::clamp(std::log10(std::max(v, 1e-300)), y.low, y.high));
  };
  std::vector<PlotBox> named;
  for (std::size_t i = 0; i < groups.size(); ++i) {
    const BoxGroup& g = groups[i];
    const double middle = f.px(static_cast<double>(i) + 0.5);
    out += words(middle, kHeight - kBottom + 16.0, g.name, " text-anchor=\"middle\"");
    const double wide = 1.6 * kBox * static_cast<double>(g.boxes.size());
    if (g.limit > 0.0)
      out += stroke(middle - 0.5 * wide - 8.0, place(g.limit), middle + 0.5 * wide + 8.0,
                    place(g.limit), "#b3202a", " stroke-dasharray=\"6 4\" stroke-width=\"1.5\"");
    for (std::size_t k = 0; k < g.boxes.size(); ++k) {
      const PlotBox& b = g.boxes[k];
      if (i == 0) named.push_back(b);
      if (!(b.largest > 0.0)) continue;
      const double x = middle - 0.5 * wide + 1.6 * kBox * static_cast<double>(k) + 0.3 * kBox;
      const std::string ink = colour(b.ink);
      out += stroke(x + 0.5 * kBox, place(b.upper), x + 0.5 * kBox, place(b.largest), ink);
      out += stroke(x + 2.0, place(b.largest), x + kBox - 2.0, place(b.largest), ink);
      out += "<rect" + attribute("x", x) + attribute("y", place(b.upper)) +
             attribute("width", kBox) +
             attribute("height", std::max(0.5, place(b.lower) - place(b.upper))) +
             " fill=\"#ffffff\" stroke=\"" + ink + "\"/>\n";
      out += stroke(x, place(b.median), x + kBox, place(b.median), ink, " stroke-width=\"2.5\"");
    }
  }
  out += "<rect" + attribute("x", kLeft) + attribute("y", kTop) + attribute("width", kInner) +
         attribute("height", f.inner()) + " fill=\"none\" stroke=\"#9aa3af\"/>\n";
  out += "<text transform=\"translate(14 " + fixed(kTop + 0.5 * f.inner()) +
         ") rotate(-90)\" text-anchor=\"middle\" fill=\"#5d6877\">" + escape_html(y_label) +
         "</text>\n";
  for (const PlotBox& b : named) words_of.curves.push_back({b.name, b.ink, {}, {}});
  words_of.limits.push_back({0.0, "limit"});
  return out + legend(words_of) + "</svg>\n";
}

std::string svg_field(const PlotField& field) {
  constexpr double kHeight = 420.0;
  const auto spread = [](const std::vector<double>& v) {
    Range r;
    for (const double a : v) r.see(a);
    const double cell = v.size() > 1 ? r.size() / static_cast<double>(v.size() - 1) : 1.0;
    return std::pair<Range, double>({r.low - 0.5 * cell, r.high + 0.5 * cell}, cell);
  };
  if (field.x.empty() || field.y.empty()) return {};
  const auto [x, wide] = spread(field.x);
  const auto [y, tall] = spread(field.y);
  if (!(x.size() > 0.0) || !(y.size() > 0.0)) return {};
  const Frame f{x, y, kHeight};
  std::string out = opening(kHeight, field.title);
  for (std::size_t r = 0; r < std::min(field.y.size(), field.value.size()); ++r) {
    const std::vector<double>& row = field.value[r];
    const std::size_t columns = std::min(field.x.size(), row.size());
    for (std::size_t c = 0, end = 0; c < columns; c = end) {
      const double v = row[c];
      for (end = c + 1; end < columns && row[end] == v;) ++end;
      if (std::isnan(v)) continue;
      const double share = std::clamp(v, 0.0, 1.0);
      const auto mix = [share](double low, double high) {
        return std::to_string(std::lround(low + share * (high - low)));
      };
      out += "<rect" + attribute("x", f.px(field.x[c] - 0.5 * wide)) +
             attribute("y", f.py(field.y[r] + 0.5 * tall)) +
             attribute("width", f.px(static_cast<double>(end - c) * wide) - f.px(0.0) + 0.2) +
             attribute("height", f.py(0.0) - f.py(tall) + 0.2) + " fill=\"rgb(" + mix(226, 190) +
             "," + mix(150, 222) + "," + mix(146, 196) + ")\"/>\n";
    }
  }
  Plot axes;
  axes.x_label = field.x_label;
  axes.y_label = field.y_label;
  return out + grid(axes, f) + marks(field.marks, f) + "</svg>\n";
}

}  // namespace smoothpost
