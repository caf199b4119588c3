#include "postproc/jobs/finish.h"

#include <array>
#include <bit>

#include "kernels/core/units.h"
#include "machines/dialects/decimal.h"
#include "postproc/jobs/settings.h"
#include "postproc/pipeline/clearance_check.h"
#include "postproc/pipeline/cuts.h"
#include "postproc/pipeline/finish_plan.h"
#include "postproc/pipeline/finish_reach.h"

namespace smoothpost {

namespace {

constexpr double kTipShare = 0.5;      // of the machine's tip tolerance
constexpr std::size_t kMostTold = 20;  // cuts in a message
constexpr double kChordShare = 0.1;    // of its tolerances, between path points

struct NumberOption {
  const char* name;
  const std::string& text;
  double least, most;
  const char* expected;
};

/// The number of an option, or `fallback` where it is not given.
double read(const NumberOption& option, double fallback, Diagnostics& errors) {
  if (option.text.empty()) return fallback;
  const auto value = read_number(option.text);
  if (value && *value >= option.least && *value <= option.most) return *value;
  errors.push_back(usage_error(
      "US166", std::string(option.name) + " " + option.text + ": expected is " + option.expected));
  return fallback;
}

/// Whether an option is its second word; its first is the default.
bool one_of(const char* name, const std::string& text, const char* first, const char* second,
            Diagnostics& errors) {
  if (!text.empty() && text != first && text != second)
    errors.push_back(usage_error(
        "US166", std::string(name) + " " + text + ": expected is " + first + " or " + second));
  return text == second;
}

std::string millimetres(double value) {
  std::string text;
  append_decimal(text, value, 3);
  return text;
}

/// One make_placed_finish().
class Placer {
 public:
  Placer(const TriangleMesh& part, const FinishRequest& request, const FinishOnMachine& on,
         const Progress& progress)
      : part_(part), request_(request), on_(on), progress_(progress) {
    if (request.scale != 1.0)
      for (Vec3& v : part_.vertices) v *= request.scale;
  }

  Result<PlacedFinish> run() {
    if (on_.placement) out_.placement = *on_.placement;
    FinishSettings settings = request_.settings;
    if (!on_.placement && !find_place(settings)) return fail();
    if (request_.leave_out)
      settings.reach_with = [this, length = settings.tool_length](const TriangleMesh& stock) {
        return reach_test(stock, length);
      };
    if (request_.leave_out || on_.placement) {
      auto made = make_finish_path(part_, settings, on_.file_name, progress_);
      add(made.diagnostics());
      if (!made.ok()) return fail();
      out_.path = std::move(made.value());
    }
    if (request_.leave_out && !leave_cuts_out()) return fail();
    out_.assumes.push_back("the part as it was printed is the stock, the part offset by " +
                           millimetres(settings.depth) +
                           " mm; input lines count the points of the path");
    out_.assumes.push_back("the end mill has a ball end of radius " +
                           millimetres(settings.mill.radius) + " mm, is as wide behind it and " +
                           millimetres(settings.mill.length) +
                           " mm long in front of the machine's bodies (--mill)");
    return Result<PlacedFinish>(std::move(out_), std::move(told_));
  }

 private:
  Result<PlacedFinish> fail() { return Result<PlacedFinish>::failure(std::move(told_)); }
  void add(const Diagnostics& list) { told_.insert(told_.end(), list.begin(), list.end()); }
  void tell(Severity severity, const char* code, std::string text) {
    Diagnostic d;
    d.severity = severity;
    d.code = code;
    d.text = std::move(text);
    d.where.file = on_.file_name;
    told_.push_back(std::move(d));
  }
  bool no_free_joint() {
    tell(Severity::error, "KN172",
         "machine " + on_.machine.name +
             " cannot finish: exactly one axis has to be redundant = true, such as the bed's "
             "rotary, beside two rotary and three linear ones");
    return false;
  }

  bool find_place(const FinishSettings& settings) {
    auto made = make_finish_path(part_, settings, on_.file_name, progress_);
    if (!made.ok() || !request_.leave_out) add(made.diagnostics());
    if (!made.ok()) return false;
    out_.path = std::move(made.value());
    const auto found = find_finish_place(out_.path, on_.machine, on_.collisions);
    if (!found) return no_free_joint();
    const Vec3& p = found->position;
    out_.placement.translation() = p;
    const std::string place =
        millimetres(p.x()) + "," + millimetres(p.y()) + "," + millimetres(p.z());
    out_.placement_text = "the part's zero lies at " + place +
                          " mm in the machine's workpiece frame, a place that smoothpost has "
                          "found: the part has to stand there";
    tell(Severity::note, "RG144",
         "the part has to stand with its zero at " + place + " mm (--work-offset G54=" + place +
             "): there the machine reaches " + std::to_string(found->reached) + " of " +
             std::to_string(found->points) + " places that were looked at");
    return true;
  }

  ReachTest reach_test(const TriangleMesh& stock, double tool_length) const {
    const auto reach =
        FinishReach::make({on_.machine, out_.placement, &stock, nullptr, on_.collisions});
    if (!reach) return [](const CutterLocation&) { return true; };  // refused later, by name
    return [reach = *reach, tool_length](const CutterLocation& at) {
      return reach.reaches(at, tool_length);
    };
  }

  // Cuts that the machine cannot follow although it reaches every place of them.
  bool leave_cuts_out() {
    ScrewChain chain = chain_of(on_.machine);
    chain.workpiece_home = chain.workpiece_home * out_.placement;
    const auto pair = RotaryPair::from(chain);
    if (!pair) return no_free_joint();
    std::optional<Scene> scene;
    if (on_.collisions) {
      auto built = machine_scene({on_.machine, chain, &out_.path.stock, nullptr,
                                  largest_allowance({}, on_.machine, false)});
      if (built.ok()) scene = std::move(built.value());
    }
    const std::vector<Cut> cuts = find_cuts(out_.path.path, {});
    const auto found = cuts_out_of_reach(
        {out_.path, cuts, on_.machine, *pair, on_.file_name, scene ? &*scene : nullptr}, progress_);
    add(found.diagnostics());
    if (!found.ok()) return false;
    const std::vector<std::size_t>& out = found.value();
    if (out.empty()) return true;
    if (out.size() == out_.path.cuts.size()) {
      tell(Severity::error, "KN174",
           "of all " + std::to_string(out.size()) +
               " cuts there is none that the machine can follow: place the part otherwise "
               "(--work-offset), or take another machine");
      return false;
    }
    double length = 0.0;
    std::string which;
    for (std::size_t k = 0; k < out.size(); ++k) {
      const FinishCut& cut = out_.path.cuts[out[k]];
      length += cut.length();
      if (k >= kMostTold) continue;
      const Vec3 at = cut.location(0.5 * cut.length()).tip.col(0);
      which += (k > 0 ? "; " : "") + millimetres(cut.length()) + " mm about " +
               millimetres(at.x()) + ", " + millimetres(at.y()) + ", " + millimetres(at.z());
    }
    tell(Severity::warning, "RG143",
         std::to_string(out.size()) + " of " + std::to_string(out_.path.cuts.size()) + " cuts, " +
             millimetres(length) +
             " mm, are left out on your word (--unreachable leave-out): no way of the redundant "
             "axis leads along them inside the ranges and clear of the part: " +
             which + (out.size() > kMostTold ? "; ..." : ""));
    out_.path = without_cuts(std::move(out_.path), out);
    return true;
  }

  TriangleMesh part_;
  const FinishRequest& request_;
  const FinishOnMachine& on_;
  const Progress& progress_;
  Diagnostics told_;
  PlacedFinish out_;
};

void append_little_endian(std::string& bytes, std::uint32_t value) {
  for (int shift = 0; shift < 32; shift += 8)
    bytes += static_cast<char>(static_cast<unsigned char>(value >> shift & 0xffU));
}

void append_vector(std::string& bytes, const Vec3& v) {
  for (int i = 0; i < 3; ++i)
    append_little_endian(bytes, std::bit_cast<std::uint32_t>(static_cast<float>(v[i])));
}

}  // namespace

Result<FinishRequest> read_finish_options(const Options& o, double tip_tolerance,
                                          double axis_tolerance) {
  FinishRequest out;
  FinishSettings& s = out.settings;
  Diagnostics errors;
  s.pitch =
      read({"--pitch", o.pitch, 1e-3, 1e3, "mm between layers, 0.001 to 1000"}, s.pitch, errors);
  s.depth =
      read({"--depth", o.depth, 1e-3, 50.0, "mm, the depth of cut, 0.001 to 50"}, s.depth, errors);
  s.feed =
      read({"--feed", o.feed, 1e-3, 1e6, "mm/min, above 0"}, s.feed * kSecondsPerMinute, errors) /
      kSecondsPerMinute;
  s.rpm = read({"--rpm", o.rpm, 0.0, 1e6, "turns of the spindle a minute"}, s.rpm, errors);
  if (!o.from.empty())
    s.from = read({"--from", o.from, -1e5, 1e5, "mm, the height of the first layer"}, 0.0, errors);
  if (!o.to.empty())
    s.to = read({"--to", o.to, -1e5, 1e5, "mm, above which there is no layer"}, 0.0, errors);
  s.lead =
      read({"--lead-in", o.lead_in, 0.0, 100.0, "mm, the radius of the arcs that lead in and out"},
           s.lead, errors);
  s.axis_tolerance =
      radians_from_degrees(read({"--normal-tolerance", o.normal_tolerance, 1e-3, 20.0,
                                 "deg that the tool axis may leave the normal by, 0.001 to 20"},
                                degrees_from_radians(s.axis_tolerance), errors));
  if (!o.direction.empty() && o.direction != "alternate" && o.direction != "same" &&
      o.direction != "helical")
    errors.push_back(usage_error(
        "US166", "--direction " + o.direction + ": expected is alternate, same or helical"));
  s.alternate = o.direction != "same";
  s.helical = o.direction == "helical";
  if (!o.mill.empty()) {
    const auto comma = o.mill.find(',');
    const auto radius = read_number(o.mill.substr(0, comma));
    const auto length =
        comma == std::string::npos ? std::nullopt : read_number(o.mill.substr(comma + 1));
    if (radius && length && *radius >= 0.05 && *radius <= 50.0 && *length > *radius &&
        *length <= 1e3)
      s.mill = {*radius, *length};
    else
      errors.push_back(usage_error(
          "US166", "--mill " + o.mill +
                       ": expected is R,L: the radius of the end mill's ball end, 0.05 to 50 mm, "
                       "and its length in front of the machine's bodies, more than R"));
  }
  s.steepest = radians_from_degrees(
      read({"--steepest", o.steepest, 1.0, 89.0, "deg between a wall's normal and level, 1 to 89"},
           degrees_from_radians(s.steepest), errors));
  out.scale = read({"--scale", o.scale, 1e-6, 1e6, "a factor of the part's size"}, 1.0, errors);
  s.outer_only = one_of("--contours", o.contours, "all", "outer", errors);
  out.leave_out = one_of("--unreachable", o.unreachable, "refuse", "leave-out", errors);
  s.tip_tolerance = kTipShare * tip_tolerance;
  s.chord_tip = kChordShare * tip_tolerance;
  s.chord_axis = kChordShare * axis_tolerance;
  const auto tools = read_tools(o.tool);
  errors.insert(errors.end(), tools.diagnostics().begin(), tools.diagnostics().end());
  if (tools.ok() && !tools.value().lengths.empty())
    s.tool_length = tools.value().lengths.begin()->second;
  if (has_error(errors)) return Result<FinishRequest>::failure(std::move(errors));
  return Result<FinishRequest>(std::move(out));
}

Result<PlacedFinish> make_placed_finish(const TriangleMesh& part, const FinishRequest& request,
                                        const FinishOnMachine& on, const Progress& progress) {
  return Placer(part, request, on, progress).run();
}

std::string stl_bytes(const TriangleMesh& mesh) {
  std::string bytes = "stock in mm, made by smoothpost";
  bytes.resize(80, ' ');
  append_little_endian(bytes, static_cast<std::uint32_t>(mesh.triangles.size()));
  bytes.reserve(84 + 50 * mesh.triangles.size());
  for (const auto& t : mesh.triangles) {
    const std::array<Vec3, 3> c{mesh.vertices[t[0]], mesh.vertices[t[1]], mesh.vertices[t[2]]};
    const Vec3 n = (c[1] - c[0]).cross(c[2] - c[0]);
    append_vector(bytes, n.norm() > 0.0 ? Vec3(n.normalized()) : Vec3::Zero());
    for (const Vec3& corner : c) append_vector(bytes, corner);
    bytes.append(2, '\0');
  }
  return bytes;
}

}  // namespace smoothpost
