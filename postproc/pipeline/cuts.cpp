#include "postproc/pipeline/cuts.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <limits>
#include <map>

#include "kernels/core/process.h"

namespace smoothpost {

namespace {

constexpr double kSamePlace = 1e-6;  // mm
constexpr double kSameAxis = 1e-9;

bool has_suffix(const std::string& text, std::string_view suffix) {
  return text.size() > suffix.size() &&
         text.compare(text.size() - suffix.size(), suffix.size(), suffix) == 0;
}

class Partition {
 public:
  Partition(ToolPath& path, const LinkChoice& choice) : path_(path), choice_(choice) {}

  std::vector<Cut> run() {
    works_.assign(path_.points.size(), false);
    const bool beam = std::any_of(path_.points.begin(), path_.points.end(),
                                  [](const PathPoint& p) { return p.beam; });
    for (std::size_t k = 1; k < path_.points.size(); ++k) {
      const PathPoint& p = path_.points[k];
      works_[k] = !p.replanned && (beam ? p.beam : p.kind == MotionKind::feed);
    }
    join(beam);
    collect();
    if (!choice_.keep) mark_links();
    if (choice_.cuts) omit();
    return std::move(cuts_);
  }

 private:
  bool stands_still(std::size_t k) const {
    const PathPoint& from = path_.points[k - 1];
    const PathPoint& to = path_.points[k];
    return !to.replanned && !to.is_arc && from.tool_length == to.tool_length &&
           (from.location.tip - to.location.tip).norm() < kSamePlace &&
           (from.location.axis - to.location.axis).norm() < kSameAxis &&
           from.rotation.angularDistance(to.rotation) < kSameAxis && from.words == to.words;
  }

  // Stretches that do not work but belong to the cut around them: micro-joints, and standing still.
  void join(bool beam) {
    for (std::size_t k = 1; k < works_.size();) {
      if (works_[k]) {
        ++k;
        continue;
      }
      std::size_t end = k;
      while (end < works_.size() && !works_[end]) ++end;
      const bool inside = k > 1 && end < works_.size();
      if (inside && (stays(k, end) || (beam && is_micro_joint(k, end))))
        std::fill(works_.begin() + static_cast<std::ptrdiff_t>(k),
                  works_.begin() + static_cast<std::ptrdiff_t>(end), true);
      k = end;
    }
  }

  bool stays(std::size_t begin, std::size_t end) const {
    for (std::size_t k = begin; k < end; ++k)
      if (!stands_still(k)) return false;
    return true;
  }

  bool is_micro_joint(std::size_t begin, std::size_t end) const {
    double length = 0.0;
    for (std::size_t k = begin; k < end; ++k) {
      const PathPoint& p = path_.points[k];
      if (p.kind != MotionKind::feed || p.replanned) return false;
      length += length_of(k);
    }
    return length <= choice_.micro_joint && only_beam_events(begin - 1, end - 1);
  }

  // The way of the tip, mm.
  double length_of(std::size_t k) const {
    const PathPoint& from = path_.points[k - 1];
    const PathPoint& to = path_.points[k];
    if (!to.is_arc) return (to.location.tip - from.location.tip).norm();
    const ArcGeometry& arc = path_.arcs[static_cast<std::size_t>(to.arc)];
    const Vec3 start(from.words[0], from.words[1], from.words[2]);
    const Vec3 end(to.words[0], to.words[1], to.words[2]);
    const double radius = arc.normal.cross(start - arc.centre).norm();
    return std::hypot(radius * arc.sweep, arc.normal.dot(end - start));
  }

  bool only_beam_events(std::size_t first, std::size_t last) const {
    const auto from =
        std::lower_bound(path_.events.begin(), path_.events.end(), first,
                         [](const PathEvent& e, std::size_t point) { return e.point < point; });
    for (auto e = from; e != path_.events.end() && e->point <= last; ++e) {
      if (e->kind == PathEvent::Kind::comment) continue;
      if (e->kind == PathEvent::Kind::dwell) return false;
      if (e->event.name != event_name::kBeamOn && e->event.name != event_name::kBeamOff &&
          e->event.name != event_name::kPower)
        return false;
    }
    return true;
  }

  void collect() {
    for (std::size_t k = 1; k < works_.size(); ++k) {
      if (!works_[k]) continue;
      if (!works_[k - 1])
        cuts_.push_back({static_cast<std::uint32_t>(k), 0, static_cast<int>(cuts_.size()) + 1});
      cuts_.back().last = static_cast<std::uint32_t>(k);
    }
  }

  void mark_links() {
    for (std::size_t k = 1; k < works_.size(); ++k)
      if (!works_[k]) make_link(k);
  }

  void make_link(std::size_t k) {
    PathPoint& p = path_.points[k];
    p.replanned = true;
    p.is_arc = false;
    p.arc = -1;
  }

  void omit() {
    std::vector<bool> left_out(path_.points.size(), true);  // points that no selected cut touches
    for (Cut& cut : cuts_) {
      cut.omitted = cut.number < choice_.cuts->first || cut.number > choice_.cuts->last;
      for (std::uint32_t k = cut.first; k <= cut.last; ++k) {
        if (cut.omitted)
          make_link(k);
        else
          left_out[k] = left_out[k - 1] = false;
      }
    }
    thin_events(left_out);
    for (Cut& cut : cuts_)
      if (cut.omitted)
        for (std::uint32_t k = cut.first; k <= cut.last; ++k) path_.points[k].beam = false;
  }

  // Keeps, of each run of events that no selected cut touches, what its end state needs.
  void thin_events(const std::vector<bool>& left_out) {
    std::vector<PathEvent> kept;
    std::map<std::string, std::size_t> state;  // group -> its last event
    const auto flush = [&] {
      std::vector<std::size_t> last;
      for (const auto& [group, event] : state) last.push_back(event);
      std::sort(last.begin(), last.end());  // program order
      for (const std::size_t i : last) kept.push_back(path_.events[i]);
      state.clear();
    };
    std::vector<std::size_t> chosen(left_out.size() + 1, 0);  // chosen points before each point
    for (std::size_t k = 0; k < left_out.size(); ++k) chosen[k + 1] = chosen[k] + !left_out[k];
    std::size_t last_point = 0;
    for (std::size_t i = 0; i < path_.events.size(); ++i) {
      PathEvent& e = path_.events[i];
      // A chosen cut in between, with or without events of its own, needs the states before it.
      if (chosen[e.point] != chosen[last_point]) flush();
      last_point = e.point;
      if (!left_out[e.point]) {
        flush();
        kept.push_back(std::move(e));
        continue;
      }
      if (e.kind != PathEvent::Kind::process) continue;
      const std::string group = state_group(e.event.name);
      if (!group.empty()) state.insert_or_assign(group, i);
    }
    flush();
    path_.events = std::move(kept);
  }

  ToolPath& path_;
  const LinkChoice& choice_;
  std::vector<bool> works_;
  std::vector<Cut> cuts_;
};

}  // namespace

namespace {

constexpr double kClosed = 0.01;   // mm
constexpr double kRetrace = 0.05;  // mm

/// The tip at a path length along a cut.
class CutLength {
 public:
  CutLength(const ReferencePath& reference, const Cut& cut) : reference_(reference), cut_(cut) {
    lengths_.push_back(0.0);
    for (std::uint32_t k = cut.first; k <= cut.last; ++k)
      lengths_.push_back(lengths_.back() + reference.length(k));
  }
  double at_point(std::size_t i) const { return lengths_[i]; }
  std::size_t points() const { return lengths_.size(); }
  double total() const { return lengths_.back(); }
  Vec3 tip(double length) const {
    const auto next = std::lower_bound(lengths_.begin() + 1, lengths_.end() - 1, length);
    const auto i = static_cast<std::size_t>(next - lengths_.begin());
    const double span = lengths_[i] - lengths_[i - 1];
    const double s = span > 0.0 ? std::clamp((length - lengths_[i - 1]) / span, 0.0, 1.0) : 1.0;
    return reference_.at(cut_.first + i - 1, s).tip;
  }

 private:
  const ReferencePath& reference_;
  const Cut& cut_;
  std::vector<double> lengths_;
};

/// The pair of points at one place with the longest way between; first == second: none.
std::pair<std::size_t, std::size_t> closing_pair(const ReferencePath& reference, const Cut& cut,
                                                 const CutLength& length) {
  using Cell = std::array<std::int64_t, 3>;
  const auto cell_of = [](const Vec3& p) {
    Cell c{};
    for (int i = 0; i < 3; ++i)
      c[static_cast<std::size_t>(i)] = static_cast<std::int64_t>(std::floor(p[i] / kClosed));
    return c;
  };
  std::map<Cell, std::size_t> first_in;
  std::pair<std::size_t, std::size_t> best{0, 0};
  double longest = 10.0 * kClosed;
  for (std::size_t i = 0; i < length.points(); ++i) {
    const Vec3& p = reference.path().points[cut.first - 1 + i].location.tip;
    const Cell c = cell_of(p);
    for (int n = 0; n < 27; ++n) {
      const auto found = first_in.find({c[0] + n % 3 - 1, c[1] + n / 3 % 3 - 1, c[2] + n / 9 - 1});
      if (found == first_in.end()) continue;
      const std::size_t k = found->second;
      const Vec3& q = reference.path().points[cut.first - 1 + k].location.tip;
      // Over an over-burn each pair is as long: the first is the contour's, whatever rounding says.
      if ((p - q).norm() > kClosed ||
          length.at_point(i) - length.at_point(k) <= longest + (best.second > 0 ? kClosed : 0.0))
        continue;
      longest = length.at_point(i) - length.at_point(k);
      best = {k, i};
    }
    first_in.try_emplace(c, i);
  }
  return best;
}

}  // namespace

CutPhases phases_of(const ReferencePath& reference, const Cut& cut) {
  const CutLength length(reference, cut);
  CutPhases phases;
  const auto& points = reference.path().points;
  for (std::uint32_t k = cut.first + 1; k <= cut.last; ++k)
    if (!points[k].beam && points[k - 1].beam) ++phases.micro_joints;
  const auto [from, to] = closing_pair(reference, cut, length);
  phases.closed = from != to;
  if (!phases.closed) {
    phases.contour = length.total();
    return phases;
  }
  phases.lead_in = length.at_point(from);
  phases.contour = length.at_point(to) - length.at_point(from);
  const double rest = length.total() - length.at_point(to);
  bool retraces = rest < phases.contour;
  for (const double share : {0.25, 0.5, 0.75, 1.0})
    retraces = retraces && (length.tip(length.at_point(to) + share * rest) -
                            length.tip(length.at_point(from) + share * rest))
                                   .norm() <= kRetrace;
  (retraces ? phases.over_burn : phases.lead_out) = rest;
  return phases;
}

std::map<std::string, std::string> states_at(const std::vector<PathEvent>& events,
                                             std::size_t point) {
  std::map<std::string, std::string> states;
  for (const PathEvent& e : events) {
    if (e.point > point) break;
    if (e.kind == PathEvent::Kind::process) note_state(e.event.name, states);
  }
  return states;
}

void note_state(const std::string& event, std::map<std::string, std::string>& states) {
  const std::string group = state_group(event);
  if (group.empty()) return;
  if (ends_state(event))
    states.erase(group);
  else
    states[group] = event;
}

std::string state_group(const std::string& event) {
  if (event == event_name::kBeamOn || event == event_name::kBeamOff || event == event_name::kPierce)
    return {};
  if (event == event_name::kPower) return "power";
  if (event == event_name::kToolChange) return "tool";
  for (const std::string_view suffix : {"_on_reverse", "_on", "_off"})
    if (has_suffix(event, suffix)) return event.substr(0, event.size() - suffix.size());
  return {};
}

bool ends_state(const std::string& event) { return has_suffix(event, "_off"); }

std::vector<Cut> find_cuts(ToolPath& path, const LinkChoice& choice) {
  return Partition(path, choice).run();
}

Result<CutRange> parse_cut_range(const std::string& text) {
  const auto refuse = [&text] {
    Diagnostic d;
    d.code = "US146";
    d.text = "--cuts \"" + text + "\" is not a cut or a range of cuts: write 7, 7-40 or 7-";
    return Result<CutRange>::failure(d);
  };
  const auto number = [](std::string_view part) {
    int value = 0;
    const auto end = std::from_chars(part.data(), part.data() + part.size(), value);
    return end.ec == std::errc() && end.ptr == part.data() + part.size() && value >= 1 ? value : 0;
  };
  const auto dash = text.find('-');
  CutRange range;
  range.first = number(std::string_view(text).substr(0, dash));
  range.last = dash == std::string::npos ? range.first
               : dash + 1 == text.size() ? std::numeric_limits<int>::max()
                                         : number(std::string_view(text).substr(dash + 1));
  if (range.first == 0 || range.last < range.first) return refuse();
  return Result<CutRange>(range);
}

}  // namespace smoothpost
