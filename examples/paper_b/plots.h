#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "examples/paper_b/study.h"

// SVG plots, written plainly.
namespace smoothpost::paper_b {

struct Line {
  std::string name;
  const Motion* motion = nullptr;
};

/// Six strips, one a joint (mm, degrees), over time; a colour a line.
void plot_joints(const std::filesystem::path& file, const std::vector<Line>& lines);
/// The same of the jerk (m/s³, rad/s³).
void plot_jerk(const std::filesystem::path& file, const std::vector<Line>& lines);
/// Quartiles of |jerk| as boxes, a whisker to the peak, on a logarithmic axis.
void plot_boxes(const std::filesystem::path& file, const std::vector<Line>& lines);

}  // namespace smoothpost::paper_b
