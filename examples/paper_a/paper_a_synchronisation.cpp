#include <algorithm>
#include <array>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <iterator>
#include <string>
#include <vector>

#include "examples/paper_a/joint_jerk.h"
#include "examples/paper_a/paper_paths.h"
#include "machines/definition/machine_file.h"

// Figs 11, 12 and 14 of [Cai2025] as numbers: synchronisation errors of orders 1 to 3 and peak
// joint jerk of the test path, by the paper's method as printed, with its links corrected,
// decoupled, and over one parameter. Arguments: the machine file, and a folder for CSV and SVG.
namespace smoothpost::paper_a {
namespace {

using Rates = std::vector<std::array<double, 2>>;

struct Method {
  std::string name;
  std::vector<Piece> pieces;        ///< of the paper's methods
  std::vector<CornerPath> blended;  ///< one, of ours
  SynchronisationErrors errors() const {
    return blended.empty() ? synchronisation(pieces) : synchronisation(blended[0]);
  }
  std::vector<Pose> poses(double step) const {
    return blended.empty() ? sample(pieces, step) : sample(blended[0], step);
  }
  Rates rate() const { return blended.empty() ? rates(pieces) : rates(blended[0]); }
  double curvature() const {
    return blended.empty() ? peak_curvature(pieces) : peak_curvature(blended[0]);
  }
};

std::vector<Method> methods(const Tolerances& t) {
  const auto sign = SignOfM2::of_the_tables;
  return {{"polyline", polyline(), {}},
          {"paper, literal", paper_path(t, sign, Links::literal), {}},
          {"decoupled", paper_path(t, sign, Links::decoupled), {}},
          {"paper, septic links", paper_path(t, sign, Links::septic), {}},
          {"CornerPath, acr", {}, {common_parameter(t, BlendKind::acr)}},
          {"CornerPath, ramp", {}, {common_parameter(t, BlendKind::ramp)}}};
}

/// One strip of |dφ/ds| over s for each method.
void write_svg(const std::filesystem::path& file, const std::vector<Method>& all) {
  constexpr double kWidth = 720.0, kStrip = 90.0, kLeft = 10.0;
  std::ofstream out(file);
  out << "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"740\" height=\""
      << kStrip * static_cast<double>(all.size()) + 60.0
      << "\" font-family=\"sans-serif\" font-size=\"12\">\n";
  out << "<text x=\"10\" y=\"18\">rotation rate |dphi/ds| over the length s of the path, each from "
         "0 to "
         "its peak</text>\n";
  double top = 30.0;
  double length = 0.0;
  for (const Method& m : all) {
    const Rates r = m.rate();
    double most = 1e-12;
    for (const auto& point : r) most = std::max(most, point[1]);
    length = r.back()[0];
    std::array<char, 32> peak{};
    std::snprintf(peak.data(), peak.size(), "%.4f", most);
    out << "<text x=\"" << kLeft << "\" y=\"" << top + 12.0 << "\">" << m.name << ", peak "
        << peak.data() << " rad/mm</text>\n"
        << "<polyline fill=\"none\" stroke=\"#1f4e9c\" points=\"";
    for (const auto& point : r) {
      std::array<char, 64> text{};
      std::snprintf(text.data(), text.size(), "%.2f,%.2f ", kLeft + kWidth * point[0] / r.back()[0],
                    top + kStrip - 8.0 - (kStrip - 28.0) * point[1] / most);
      out << text.data();
    }
    out << "\"/>\n";
    top += kStrip;
  }
  std::array<char, 48> end{};
  std::snprintf(end.data(), end.size(), "s = %.1f mm", length);
  out << "<text x=\"" << kLeft << "\" y=\"" << top + 14.0 << "\">s = 0</text>\n"
      << "<text x=\"730\" y=\"" << top + 14.0 << "\" text-anchor=\"end\">" << end.data()
      << "</text>\n</svg>\n";
}

void write_csv(const std::filesystem::path& file, const std::vector<Method>& all) {
  std::ofstream out(file);
  out << "method,s_mm,rate_rad_per_mm\n";
  for (const Method& m : all)
    for (const auto& point : m.rate())
      out << '"' << m.name << "\"," << point[0] << ',' << point[1] << '\n';
}

void print_errors(const std::vector<Method>& all) {
  std::printf("%-20s | largest jump of d phi/ds, d2, d3 | peak of the same | curvature 1/mm\n",
              "method");
  for (const Method& m : all) {
    const SynchronisationErrors e = m.errors();
    std::printf("%-20s | %9.2e %9.2e %9.2e | %9.2e %9.2e %9.2e | %7.3f\n", m.name.c_str(),
                e.at_junctions[0], e.at_junctions[1], e.at_junctions[2], e.peak[0], e.peak[1],
                e.peak[2], m.curvature());
  }
}

void print_jerk(const std::vector<Method>& all, const SixR& arm) {
  constexpr double kFeed = 30.0;  // mm/s, constant
  std::printf("%-20s | peak joint jerk, rad/s3, at 1 / 0.4 / 0.2 ms | ratio of the last two\n",
              "method");
  for (const Method& m : all) {
    std::array<double, 3> peak{};
    constexpr std::array<double, 3> kTimes = {1e-3, 4e-4, 2e-4};
    for (std::size_t i = 0; i < 3; ++i)
      peak[i] = peak_joint_jerk(arm, m.poses(kFeed * kTimes[i]), kTimes[i], {});
    std::printf("%-20s | %9.3g %9.3g %9.3g | %5.2f\n", m.name.c_str(), peak[0], peak[1], peak[2],
                peak[2] / peak[1]);
  }
}

}  // namespace
}  // namespace smoothpost::paper_a

int main(int argc, char** argv) {
  using namespace smoothpost;
  if (argc < 2) {
    std::cerr << "usage: example_paper_a_synchronisation machine.toml [folder]\n";
    return 2;
  }
  std::ifstream file(argv[1]);
  const std::string text{std::istreambuf_iterator<char>(file), {}};
  const auto machine = parse_machine_file(text, argv[1]);
  const auto arm = machine.ok() ? SixR::from(chain_of(machine.value(), 100.0)) : std::nullopt;
  if (!arm) {
    std::cerr << argv[1] << ": not a six-axis arm with spherical wrist\n";
    return 2;
  }
  for (const paper_a::Tolerances& t : {paper_a::Tolerances{0.8, 0.01}, {1.2, 0.005}}) {
    const auto all = paper_a::methods(t);
    std::printf("tolerances %.1f mm, %.3f rad\n", t.tip, t.axis);
    paper_a::print_errors(all);
    paper_a::print_jerk(all, *arm);
    if (argc < 3) continue;
    const std::string name = "synchronisation_" + std::to_string(t.tip).substr(0, 3);
    std::filesystem::create_directories(argv[2]);
    paper_a::write_csv(std::filesystem::path(argv[2]) / (name + ".csv"), all);
    paper_a::write_svg(std::filesystem::path(argv[2]) / (name + ".svg"), all);
  }
  return 0;
}
