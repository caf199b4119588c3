#pragma once

#include <string>
#include <utility>
#include <vector>

// Plots as SVG text, drawn so that they need nothing around them: inline in a page or as a file.
namespace smoothpost {

enum class Ink { after, before, limit, part, mark };

/// A curve; a NaN in y is a gap.
struct PlotCurve {
  std::string name;  ///< in the legend; empty: none
  Ink ink = Ink::after;
  std::vector<double> x, y;
};

struct PlotLimit {
  double value = 0.0;
  std::string name;
};

struct PlotMark {
  double x = 0.0, y = 0.0;
  std::string name;
};

struct Plot {
  std::string title, x_label, y_label;
  std::vector<PlotCurve> curves;
  std::vector<PlotLimit> limits;                 ///< horizontal lines
  std::vector<std::pair<double, double>> bands;  ///< of x, ascending: grey behind the curves
  std::vector<PlotMark> marks;
  bool of_time = false;     ///< a page may move a cursor along x
  bool of_function = true;  ///< x ascends: many points become the range of each column
  bool equal_scales = false;
  bool limits_of_size = false;  ///< limits are of the size: what is used of them can be told
  double height = 210.0;
};

/// One <svg>, 760 wide. A curve of more than two points a pixel is drawn as the least and the
/// largest value in each, so no peak of the samples is lost. A limit farther from the data than
/// they extend is not drawn but named (with the share of it that is used, limits_of_size), so that
/// the curve stays readable. Text is escaped; the same plot gives the same bytes. Cost: linear in
/// the points.
std::string svg(const Plot& plot);

/// Distribution of a size ≥ 0 in one group: quartiles and largest value.
struct PlotBox {
  std::string name;
  Ink ink = Ink::after;
  double lower = 0.0, median = 0.0, upper = 0.0, largest = 0.0;
};

struct BoxGroup {
  std::string name;  ///< below its boxes
  std::vector<PlotBox> boxes;
  double limit = 0.0;  ///< a short line; 0: none
};

/// Boxes from quartile to quartile with a whisker to the largest value, on a logarithmic axis.
std::string svg_boxes(const std::string& title, const std::string& y_label,
                      const std::vector<BoxGroup>& groups);

/// A field of cells, rows from below; `value` in [0, 1]: 0 red (not possible), 1 green.
struct PlotField {
  std::string title, x_label, y_label;
  std::vector<double> x, y;                ///< of columns and rows, ascending
  std::vector<std::vector<double>> value;  ///< [row][column]; NaN: empty
  std::vector<PlotMark> marks;
};
std::string svg_field(const PlotField& field);

/// Quartiles of sizes; zeros for none.   Cost: linear.
PlotBox box_of(std::string name, Ink ink, std::vector<double> sizes);

}  // namespace smoothpost
