#pragma once

#include <string>
#include <vector>

#include "postproc/report/motion_record.h"

namespace smoothpost {

/// A plot of a report: `name` is its file's name without .svg (letters, digits, '_' and '-').
struct NamedPlot {
  std::string name;
  std::string group;  ///< axis_<name>, feed, deviation, jerk, path, rotary, domain
  std::string caption;
  std::string svg;
};

struct PlotData {
  const PageInput& in;
  const ReferencePath* reference = nullptr;
  const ProgramMotion& motion;
  const MotionRecord& after;   ///< planned_record(), or printed_record()
  const MotionRecord& before;  ///< input_record()
};

/// Every plot that there are data for: position, velocity, acceleration and jerk of each axis with
/// its limits, tip speed, deviation of tip and axis along the way, distributions of the jerk, paths
/// of the rotaries, two views of the path, and the fields of `domain_maps` when the JSON report has
/// them. Cost: linear in samples and points.
std::vector<NamedPlot> report_plots(const PlotData& data);

/// Largest size of each quantity of an axis in a record; NaN where nothing is known.
double largest(const MotionRecord& record, MotionRecord::Order order, std::size_t axis);

}  // namespace smoothpost
