#include "examples/paper_b/plots.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <fstream>
#include <functional>

#include "examples/nc_text.h"
#include "kernels/core/units.h"

namespace smoothpost::paper_b {

namespace {

using examples::fixed;

constexpr std::array<const char*, 6> kColours = {"#9a9a9a", "#d08a1d", "#b3202a",
                                                 "#1f4e9c", "#2a8a4a", "#7a3b9c"};
constexpr double kWidth = 760.0;
constexpr double kStrip = 120.0;
constexpr double kLeft = 80.0;
constexpr double kTop = 48.0;

/// The value of a joint at a step of a motion.
using Value = std::function<double(const Motion&, std::size_t, std::size_t)>;

double display(std::size_t joint, double linear, double rotary) {
  return joint == 3 || joint == 4 ? rotary : linear;
}

void text(std::ofstream& out, double x, double y, const std::string& words) {
  out << "<text x=\"" << fixed(x, 1) << "\" y=\"" << fixed(y, 1) << "\">" << words << "</text>\n";
}

void open(std::ofstream& out, double height, const std::string& title) {
  out << "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"" << fixed(kLeft + kWidth + 20.0, 0)
      << "\" height=\"" << fixed(height, 0)
      << "\" font-family=\"sans-serif\" font-size=\"12\">\n"
         "<rect width=\"100%\" height=\"100%\" fill=\"white\"/>\n";
  text(out, 10.0, 18.0, title);
}

void legend(std::ofstream& out, const std::vector<Line>& lines) {
  for (std::size_t k = 0; k < lines.size(); ++k) {
    const double x = kLeft + 125.0 * static_cast<double>(k);
    out << "<rect x=\"" << fixed(x, 1) << "\" y=\"28\" width=\"12\" height=\"8\" fill=\""
        << kColours[k % kColours.size()] << "\"/>\n";
    text(out, x + 16.0, 36.0, lines[k].name);
  }
}

/// Digits that tell the ends of a strip apart.
int decimals(double size) { return size < 1.0 ? 3 : size < 100.0 ? 1 : 0; }

void strip(std::ofstream& out, const std::vector<Line>& lines, std::size_t joint,
           const Value& value) {
  double low = 1e300, high = -1e300, end = 0.0;
  for (const Line& line : lines)
    for (std::size_t i = 0; i < line.motion->time.size(); ++i) {
      const double v = value(*line.motion, i, joint);
      low = std::min(low, v);
      high = std::max(high, v);
      end = std::max(end, line.motion->time[i]);
    }
  const double range = std::max(high - low, 1e-9);
  const double top = kTop + kStrip * static_cast<double>(joint) + 8.0;
  const double tall = kStrip - 20.0;
  out << "<rect x=\"" << kLeft << "\" y=\"" << fixed(top, 1) << "\" width=\"" << kWidth
      << "\" height=\"" << tall << "\" fill=\"none\" stroke=\"#cccccc\"/>\n";
  for (std::size_t k = 0; k < lines.size(); ++k) {
    out << "<polyline fill=\"none\" stroke-width=\"1.2\" stroke=\"" << kColours[k % kColours.size()]
        << "\" points=\"";
    const Motion& m = *lines[k].motion;
    const std::size_t every = std::max<std::size_t>(1, m.time.size() / 1500);
    for (std::size_t i = 0; i < m.time.size(); i += every)
      out << fixed(kLeft + kWidth * m.time[i] / end, 2) << ','
          << fixed(top + tall * (high - value(m, i, joint)) / range, 2) << ' ';
    out << "\"/>\n";
  }
  const int digits = decimals(std::max(std::abs(high), std::abs(low)));
  text(out, 4.0, top + 10.0, fixed(high, digits));
  text(out, 4.0, top + 0.5 * tall + 4.0, "q" + std::to_string(joint + 1));
  text(out, 4.0, top + tall, fixed(low, digits));
  if (joint == 5) text(out, kLeft + kWidth - 60.0, top + tall + 14.0, fixed(end, 3) + " s");
}

void plot(const std::filesystem::path& file, const std::vector<Line>& lines,
          const std::string& title, const Value& value) {
  std::ofstream out(file, std::ios::binary);
  open(out, kTop + 6.0 * kStrip + 20.0, title);
  legend(out, lines);
  for (std::size_t joint = 0; joint < 6; ++joint) strip(out, lines, joint, value);
  out << "</svg>\n";
}

/// One box with whiskers; y of the numbers by `place`.
void box(std::ofstream& out, double x, std::size_t line, const std::array<double, 4>& y) {
  const char* colour = kColours[line % kColours.size()];
  const auto stroke = [&](double x0, double y0, double x1, double y1) {
    out << "<line x1=\"" << fixed(x0, 1) << "\" y1=\"" << fixed(y0, 1) << "\" x2=\"" << fixed(x1, 1)
        << "\" y2=\"" << fixed(y1, 1) << "\" stroke=\"" << colour << "\"/>\n";
  };
  stroke(x + 6.0, y[2], x + 6.0, y[3]);
  stroke(x + 2.0, y[3], x + 10.0, y[3]);
  stroke(x, y[1], x + 12.0, y[1]);
  out << "<rect x=\"" << fixed(x, 1) << "\" y=\"" << fixed(y[2], 1) << "\" width=\"12\" height=\""
      << fixed(std::max(0.5, y[0] - y[2]), 1) << "\" fill=\"none\" stroke=\"" << colour << "\"/>\n";
}

}  // namespace

void plot_joints(const std::filesystem::path& file, const std::vector<Line>& lines) {
  plot(file, lines, "joints over time, mm and degrees",
       [](const Motion& m, std::size_t i, std::size_t joint) {
         const double q = m.joints[i][joint];
         return display(joint, q, degrees_from_radians(q));
       });
}

void plot_jerk(const std::filesystem::path& file, const std::vector<Line>& lines) {
  plot(file, lines, "jerk over time, m/s3 and rad/s3",
       [](const Motion& m, std::size_t i, std::size_t joint) {
         const double j = m.jerk[i][joint];
         return display(joint, j / 1000.0, j);
       });
}

void plot_boxes(const std::filesystem::path& file, const std::vector<Line>& lines) {
  constexpr double kLow = -3.0, kHigh = 7.0, kTall = 420.0;
  std::ofstream out(file, std::ios::binary);
  open(out, kTop + kTall + 30.0,
       "distribution of |jerk| in equal times, m/s3 (q1 q2 q3 q6) and rad/s3 (q4 q5)");
  legend(out, lines);
  const auto place = [=](double size) {
    const double log = std::clamp(std::log10(std::max(size, 1e-30)), kLow, kHigh);
    return kTop + kTall * (kHigh - log) / (kHigh - kLow);
  };
  for (int power = -3; power <= 7; ++power) {
    const double y = place(std::pow(10.0, power));
    out << "<line x1=\"" << kLeft << "\" y1=\"" << fixed(y, 1) << "\" x2=\""
        << fixed(kLeft + kWidth, 1) << "\" y2=\"" << fixed(y, 1) << "\" stroke=\"#dddddd\"/>\n";
    text(out, 30.0, y + 4.0, "1e" + std::to_string(power));
  }
  for (std::size_t joint = 0; joint < 6; ++joint) {
    const double left = kLeft + 12.0 + kWidth / 6.0 * static_cast<double>(joint);
    text(out, left + 30.0, kTop + kTall + 18.0, "q" + std::to_string(joint + 1));
    for (std::size_t k = 0; k < lines.size(); ++k) {
      const JerkNumbers n = jerk_numbers(*lines[k].motion, static_cast<int>(joint));
      const double unit = display(joint, 1000.0, 1.0);
      if (n.peak <= 0.0) continue;
      box(out, left + 18.0 * static_cast<double>(k), k,
          {place(n.lower / unit), place(n.median / unit), place(n.upper / unit),
           place(n.peak / unit)});
    }
  }
  out << "</svg>\n";
}

}  // namespace smoothpost::paper_b
