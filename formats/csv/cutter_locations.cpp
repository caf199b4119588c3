#include "formats/csv/cutter_locations.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <optional>
#include <system_error>
#include <utility>
#include <vector>

#include "kernels/core/process.h"
#include "kernels/core/signed_number.h"
#include "kernels/core/units.h"

namespace smoothpost {

namespace {

constexpr std::size_t kMaxErrors = 100;
constexpr double kLargestCoordinate = 1.0e6;  // mm
constexpr double kUnitLength = 1e-3;          // an axis further from length 1 is worth a warning
constexpr double kShortestAxis = 1e-6;

/// The columns of interface "CSV of cutter locations".
// clang-format off
enum Column {
  kX, kY, kZ, kI, kJ, kK, kQw, kQx, kQy, kQz, kRz, kRy, kRx, kFeed, kBeam, kLine, kColumns
};
constexpr std::array<std::string_view, kColumns> kNames = {
    "x_mm", "y_mm", "z_mm", "i", "j", "k", "qw", "qx", "qy", "qz", "rz_deg", "ry_deg", "rx_deg",
    "feed_mm_per_min", "beam", "line"};
// clang-format on

/// The three ways to write an orientation, as ranges of columns.
struct Orientation {
  Column first;
  Column beyond;
};
constexpr std::array<Orientation, 3> kOrientations = {Orientation{kI, kQw}, Orientation{kQw, kRz},
                                                      Orientation{kRz, kFeed}};

struct Field {
  std::string_view text;
  int column = 0;
};

struct Line {
  std::string_view text;  ///< without line end and comment
  int number = 0;
};

std::string_view trimmed(std::string_view text) {
  const auto blank = [](char c) { return c == ' ' || c == '\t' || c == '\r'; };
  while (!text.empty() && blank(text.front())) text.remove_prefix(1);
  while (!text.empty() && blank(text.back())) text.remove_suffix(1);
  return text;
}

std::string quoted(std::string_view text) {
  std::string out = "`";
  for (const char c : text.substr(0, 40))
    out += static_cast<unsigned char>(c) < 32 || c == 127 ? '?' : c;
  return out + (text.size() > 40 ? "...`" : "`");
}

std::vector<Field> split(std::string_view line) {
  std::vector<Field> fields;
  std::size_t begin = 0;
  while (true) {
    const std::size_t comma = std::min(line.find(',', begin), line.size());
    const std::string_view raw = line.substr(begin, comma - begin);
    const std::string_view text = trimmed(raw);
    const std::size_t at =
        text.empty() ? begin : static_cast<std::size_t>(text.data() - line.data());
    fields.push_back({text, static_cast<int>(at) + 1});
    if (comma == line.size()) return fields;
    begin = comma + 1;
  }
}

class Reader {
 public:
  Reader(std::string_view text, const std::string& file) : text_(text), file_(file) {
    if (text_.substr(0, 3) == "\xef\xbb\xbf") text_.remove_prefix(3);
  }

  Result<ToolPath> run() {
    const auto header = next_line();
    if (!header) {
      complain("CSV101", {},
               "no header line; the first line names the columns: x_mm,y_mm,z_mm,i,j,k,...");
    } else if (read_header(*header)) {
      while (const auto line = next_line()) {
        if (errors_ > kMaxErrors) break;
        read_row(*line);
      }
      finish();
    }
    if (has_error(found_)) return Result<ToolPath>::failure(std::move(found_));
    return Result<ToolPath>(std::move(path_), std::move(found_));
  }

 private:
  /// The next line with something in it.
  std::optional<Line> next_line() {
    while (at_ < text_.size()) {
      const std::size_t end = std::min(text_.find('\n', at_), text_.size());
      std::string_view line = text_.substr(at_, end - at_);
      at_ = end + 1;
      ++number_;
      line = line.substr(0, line.find('#'));
      if (!trimmed(line).empty()) return Line{line, number_};
    }
    return std::nullopt;
  }

  // ---- header
  // ----------------------------------------------------------------------------------------

  bool read_header(const Line& line) {
    line_ = line.number;
    header_line_ = line.number;
    columns_ = split(line.text).size();
    place_.fill(-1);
    const auto fields = split(line.text);
    for (std::size_t i = 0; i < fields.size(); ++i) name_column(fields[i], static_cast<int>(i));
    require_columns(kX, kI, "the tool tip");
    choose_orientation();
    if (place_[kFeed] < 0)
      complain("CSV109", {},
               "no column feed_mm_per_min: add it (0 or an empty field is a rapid), there is no "
               "default feed");
    return errors_ == 0;
  }

  void name_column(const Field& field, int index) {
    const auto found = std::find(kNames.begin(), kNames.end(), field.text);
    if (found == kNames.end()) {
      std::string text = "unknown column " + quoted(field.text) + "; known are";
      for (const auto name : kNames)
        text += (name == kNames.front() ? " " : ", ") + std::string(name);
      if (columns_ == 1 && field.text.find(';') != std::string_view::npos)
        text = "columns are separated by commas, found semicolons";
      complain("CSV102", field, text);
      return;
    }
    int& place = place_[static_cast<std::size_t>(found - kNames.begin())];
    if (place >= 0)
      complain("CSV103", field, "column " + quoted(field.text) + " stands here a second time");
    else
      place = index;
  }

  void require_columns(Column first, Column beyond, const char* what) {
    for (int c = first; c < beyond; ++c)
      if (place_[static_cast<std::size_t>(c)] < 0)
        complain("CSV104", {},
                 std::string(what) + " needs a column " +
                     std::string(kNames[static_cast<std::size_t>(c)]));
  }

  void choose_orientation() {
    int chosen = -1;
    for (std::size_t k = 0; k < kOrientations.size(); ++k) {
      const auto& columns = kOrientations[k];
      const bool named =
          std::any_of(place_.begin() + columns.first, place_.begin() + columns.beyond,
                      [](int place) { return place >= 0; });
      if (!named) continue;
      if (chosen >= 0)
        complain("CSV104", {},
                 "two orientations: keep one of i,j,k / qw,qx,qy,qz / rz_deg,ry_deg,rx_deg");
      chosen = static_cast<int>(k);
      require_columns(columns.first, columns.beyond, "the orientation");
    }
    if (chosen < 0)
      complain("CSV104", {},
               "no orientation: add i,j,k (tool axis), qw,qx,qy,qz or rz_deg,ry_deg,rx_deg");
    else
      orientation_ = kOrientations[static_cast<std::size_t>(chosen)].first;
  }

  // ---- rows
  // ------------------------------------------------------------------------------------------

  void read_row(const Line& line) {
    line_ = line.number;
    fields_ = split(line.text);
    if (fields_.size() != columns_) {
      complain("CSV105", fields_[std::min(fields_.size() - 1, columns_)],
               std::to_string(fields_.size()) + " fields, the header in line " +
                   std::to_string(header_line_) + " names " + std::to_string(columns_) +
                   " columns");
      return;
    }
    const std::size_t before = errors_;
    PathPoint point;
    point.location.tip = {number(kX), number(kY), number(kZ)};
    orient(point);
    point.line = line_number();
    const double feed = field(kFeed).text.empty() ? 0.0 : number(kFeed);
    if (feed < 0.0)
      complain("CSV110", field(kFeed), "feed " + quoted(field(kFeed).text) + " below 0");
    point.beam = place_[kBeam] >= 0 && beam();
    // The first row has no segment: its feed and beam are read, and mean nothing.
    const bool first = path_.points.empty();
    if (!first && feed == 0.0 && point.beam && errors_ == before)
      complain("CSV112", field(kFeed),
               "beam on in a rapid: give the segment a feed or switch the beam off");
    if (errors_ != before) return;
    add(std::move(point), feed);
  }

  void add(PathPoint point, double feed) {
    if (path_.points.empty()) {
      point.beam = false;
    } else {
      const PathPoint& last = path_.points.back();
      if (feed > 0.0) {
        point.kind = MotionKind::feed;
        point.duration = kSecondsPerMinute * (point.location.tip - last.location.tip).norm() / feed;
      }
      switch_beam(point.beam, last.line);
    }
    path_.points.push_back(std::move(point));
  }

  /// Puts the event where the path has reached the last point so far.
  void switch_beam(bool on, std::uint32_t line) {
    if (on == beam_) return;
    beam_ = on;
    PathEvent event;
    event.point = path_.points.size() - 1;
    event.event.name = on ? event_name::kBeamOn : event_name::kBeamOff;
    event.event.line = line;
    event.line = line;
    path_.events.push_back(std::move(event));
  }

  void finish() {
    if (errors_ > kMaxErrors)
      found_.push_back({Severity::note,
                        "CSV116",
                        "reading stops after " + std::to_string(kMaxErrors) + " errors",
                        {file_, number_, 0}});
    if (errors_ > 0) return;
    path_.full_pose = orientation_ != kI;
    if (path_.points.empty()) {
      complain("CSV114", {}, "no row after the header");
      return;
    }
    switch_beam(false, path_.points.back().line);
    if (long_axes_ > 0)
      found_.push_back(
          {Severity::warning,
           "CSV115",
           std::to_string(long_axes_) +
               " rows have a tool axis or quaternion that is not of length 1 (this is the first "
               "of them); its direction is taken",
           {file_, first_long_axis_, 0}});
  }

  // ---- fields
  // ----------------------------------------------------------------------------------------

  const Field& field(Column column) const {
    return fields_[static_cast<std::size_t>(place_[column])];
  }

  double number(Column column) {
    const Field& from = field(column);
    const std::string_view digits = from.text;
    double value = 0.0;
    const auto end = from_signed(digits, value);
    if (end.ec == std::errc::invalid_argument || end.ptr != digits.data() + digits.size()) {
      complain(
          "CSV106", from,
          "column " + std::string(kNames[column]) + ": " + quoted(from.text) + " is not a number");
      return 0.0;
    }
    if (end.ec != std::errc() || !std::isfinite(value) || std::abs(value) > kLargestCoordinate) {
      complain("CSV107", from,
               "column " + std::string(kNames[column]) + ": " + quoted(from.text) +
                   " is beyond 1000000 or not finite");
      return 0.0;
    }
    return value;
  }

  void orient(PathPoint& point) {
    if (orientation_ == kI) {
      const Vec3 written{number(kI), number(kJ), number(kK)};
      point.location.axis = written / checked_length(written.norm());
      return;
    }
    point.interpolation = PathInterpolation::slerp;
    if (orientation_ == kQw) {
      Eigen::Quaterniond q{number(kQw), number(kQx), number(kQy), number(kQz)};
      q.coeffs() /= checked_length(q.norm());
      point.rotation = q;
    } else {
      const Vec3 angles{number(kRz), number(kRy), number(kRx)};
      point.rotation = Eigen::Quaterniond(rotation_from_rpy(radians_from_degrees(angles[2]),
                                                            radians_from_degrees(angles[1]),
                                                            radians_from_degrees(angles[0])));
    }
    point.location.axis = point.rotation.toRotationMatrix().col(2).normalized();
  }

  double checked_length(double length) {
    if (length < kShortestAxis) {
      complain("CSV108", field(orientation_),
               orientation_ == kI ? "tool axis i,j,k of length 0" : "quaternion of length 0");
      return 1.0;
    }
    if (std::abs(length - 1.0) > kUnitLength && long_axes_++ == 0) first_long_axis_ = line_;
    return length;
  }

  bool beam() {
    const Field& from = field(kBeam);
    if (from.text == "0" || from.text == "1") return from.text == "1";
    complain("CSV111", from, "column beam: " + quoted(from.text) + " is neither 0 nor 1");
    return false;
  }

  std::uint32_t line_number() {
    if (place_[kLine] < 0) return static_cast<std::uint32_t>(line_);
    const Field& from = field(kLine);
    std::uint32_t value = 0;
    const auto end = std::from_chars(from.text.data(), from.text.data() + from.text.size(), value);
    if (end.ec != std::errc() || end.ptr != from.text.data() + from.text.size())
      complain("CSV113", from,
               "column line: " + quoted(from.text) + " is not a whole number from 0 to 4294967295");
    return value;
  }

  void complain(const char* code, const Field& where, std::string text) {
    if (++errors_ > kMaxErrors) return;
    found_.push_back({Severity::error, code, std::move(text), {file_, line_, where.column}});
  }

  std::string_view text_;
  const std::string& file_;
  std::size_t at_ = 0;
  int number_ = 0;
  int line_ = 0;
  int header_line_ = 0;
  std::size_t columns_ = 0;
  std::array<int, kColumns> place_{};
  Column orientation_ = kI;
  std::vector<Field> fields_;
  bool beam_ = false;
  std::size_t errors_ = 0;
  std::size_t long_axes_ = 0;
  int first_long_axis_ = 0;
  ToolPath path_;
  Diagnostics found_;
};

}  // namespace

Result<ToolPath> read_cutter_locations(std::string_view text, const std::string& file_name) {
  return Reader(text, file_name).run();
}

}  // namespace smoothpost
