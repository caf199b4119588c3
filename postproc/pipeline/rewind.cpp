#include "postproc/pipeline/rewind.h"

#include <algorithm>
#include <cmath>

#include "kernels/core/contract.h"
#include "kernels/core/process.h"

namespace smoothpost {

namespace {

constexpr double kWhole = 1.0 - 1e-9;  // a share above this is the segment's end

bool starts_cycle(const PathEvent& e) {
  if (e.kind == PathEvent::Kind::dwell) return true;
  if (e.kind != PathEvent::Kind::process) return false;
  const std::string& name = e.event.name;
  return name == event_name::kBeamOn || name == event_name::kPierce || name == event_name::kPower ||
         name == "gas_on" || name == "follow_on";
}

bool ends_cycle(const PathEvent& e) {
  return e.kind == PathEvent::Kind::process &&
         (e.event.name == event_name::kBeamOff || e.event.name == "gas_off" ||
          e.event.name == "follow_off");
}

class Splitter {
 public:
  Splitter(ToolPath& path, std::vector<Cut>& cuts, const ReferencePath::Frames& frames,
           double over_burn)
      : path_(path), cuts_(cuts), reference_(path, frames), over_burn_(over_burn) {}

  void split(const SplitPlace& place) {
    const auto cut = std::find_if(cuts_.begin(), cuts_.end(), [&](const Cut& c) {
      return c.first <= place.segment && place.segment <= c.last;
    });
    require(cut != cuts_.end(), "a split lies in a cut");
    if (place.segment == cut->last && place.s > kWhole) return;  // nothing is left to cut
    const SplitPlace back = behind(*cut, place);
    PathPoint stop = point_at(place);
    PathPoint again = point_at(back);
    again.replanned = true;
    again.is_arc = false;
    again.arc = -1;
    again.beam = false;
    again.duration = 0.0;
    std::vector<PathPoint> inserted;
    if (place.s <= kWhole) inserted.push_back(part(place.segment, 0.0, place.s, stop));
    inserted.push_back(again);
    for (std::uint32_t k = back.segment; k <= place.segment; ++k) {
      const double from = k == back.segment ? back.s : 0.0;
      if (from > kWhole) continue;
      if (k == place.segment && place.s > kWhole && k != back.segment) {
        inserted.push_back(path_.points[k]);
        continue;
      }
      inserted.push_back(part(k, from, 1.0, path_.points[k]));
    }
    insert(*cut, place, std::move(inserted));
  }

 private:
  /// The place `over_burn` before `place`, inside the cut and behind its inner events.
  SplitPlace behind(const Cut& cut, const SplitPlace& place) const {
    double left = over_burn_;
    SplitPlace back = place;
    while (left > 0.0) {
      const double length = reference_.length(back.segment);
      const double here = back.s * length;
      if (here >= left) {
        back.s -= left / length;
        break;
      }
      left -= here;
      back.s = 0.0;
      if (back.segment == cut.first || has_event(back.segment - 1)) break;
      --back.segment;
      back.s = 1.0;
    }
    return back;
  }

  bool has_event(std::size_t point) const {
    return std::any_of(path_.events.begin(), path_.events.end(), [point](const PathEvent& e) {
      return e.point == point && e.kind == PathEvent::Kind::process;
    });
  }

  PathPoint point_at(const SplitPlace& place) const {
    PathPoint p = path_.points[place.segment];
    if (place.s > kWhole) return p;
    p.location = reference_.at(place.segment, place.s);
    if (path_.full_pose) p.rotation = reference_.rotation_at(place.segment, place.s);
    p.words = reference_.words_at(place.segment, place.s);
    return p;
  }

  /// The part of a segment from share `from` to `to`, ending at `end`.
  PathPoint part(std::uint32_t segment, double from, double to, PathPoint end) {
    const PathPoint& whole = path_.points[segment];
    end.duration = whole.duration * (to - from);
    end.is_arc = whole.is_arc;
    end.replanned = false;
    end.beam = whole.beam;
    if (whole.is_arc) {
      ArcGeometry arc = path_.arcs[static_cast<std::size_t>(whole.arc)];
      arc.sweep *= to - from;
      end.arc = static_cast<std::int32_t>(path_.arcs.size());
      path_.arcs.push_back(arc);
    }
    return end;
  }

  void insert(Cut& cut, const SplitPlace& place, std::vector<PathPoint> inserted) {
    const std::size_t k = place.segment;
    const bool whole = place.s > kWhole;
    const std::size_t stop = k;                       // point where the first half ends
    const std::size_t again = whole ? k + 1 : k + 1;  // point where the second half starts
    // The last inserted point is the old point k; with a whole segment the old one stays in front.
    const std::size_t added = whole ? inserted.size() : inserted.size() - 1;
    std::vector<PathEvent> ending, starting;
    for (const PathEvent& e : path_.events) {
      if (e.point == cut.last && ends_cycle(e)) ending.push_back(e);
      if (e.point + 1 == cut.first && !e.before_start && starts_cycle(e)) starting.push_back(e);
    }
    for (PathEvent& e : starting) e.event = state_at(cut, k, e.event);
    if (!path_.points[k].beam) drop_beam_on(starting);
    if (!whole) path_.points.erase(path_.points.begin() + static_cast<std::ptrdiff_t>(k));
    path_.points.insert(path_.points.begin() + static_cast<std::ptrdiff_t>(whole ? k + 1 : k),
                        inserted.begin(), inserted.end());
    for (PathEvent& e : path_.events)
      if (e.point >= k) e.point += added;
    for (PathEvent& e : ending) {
      e.point = stop;
      path_.events.push_back(e);
    }
    for (PathEvent& e : starting) {
      e.point = again;
      path_.events.push_back(e);
    }
    std::stable_sort(path_.events.begin(), path_.events.end(),
                     [](const PathEvent& a, const PathEvent& b) { return a.point < b.point; });
    shift_cuts(cut, stop, again, added);
  }

  /// In a micro-joint the second half starts without beam; it comes on where the input has it.
  static void drop_beam_on(std::vector<PathEvent>& starting) {
    const auto is = [](const PathEvent& e, const char* name) {
      return e.kind == PathEvent::Kind::process && e.event.name == name;
    };
    if (std::none_of(starting.begin(), starting.end(),
                     [&](const PathEvent& e) { return is(e, event_name::kBeamOn); }))
      return;
    std::erase_if(starting, [&](const PathEvent& e) {
      return e.kind == PathEvent::Kind::dwell || is(e, event_name::kBeamOn) ||
             is(e, event_name::kPierce);
    });
  }

  /// What `event` of the cut's start has become before point `end` of the cut: another power.
  ProcessEvent state_at(const Cut& cut, std::size_t end, ProcessEvent event) const {
    const std::string group = state_group(event.name);
    if (group.empty()) return event;
    for (const PathEvent& e : path_.events)
      if (e.kind == PathEvent::Kind::process && e.point + 1 > cut.first && e.point < end &&
          state_group(e.event.name) == group)
        event = e.event;
    return event;
  }

  void shift_cuts(Cut& cut, std::size_t stop, std::size_t again, std::size_t added) {
    Cut second = cut;
    second.after_rewind = true;
    second.first = static_cast<std::uint32_t>(again + 1);
    second.last = cut.last + static_cast<std::uint32_t>(added);
    cut.last = static_cast<std::uint32_t>(stop);
    for (Cut& other : cuts_)
      if (other.first > cut.first && &other != &cut) {
        other.first += static_cast<std::uint32_t>(added);
        other.last += static_cast<std::uint32_t>(added);
      }
    cuts_.insert(cuts_.begin() + (&cut - cuts_.data()) + 1, second);
  }

  ToolPath& path_;
  std::vector<Cut>& cuts_;
  ReferencePath reference_;
  double over_burn_;
};

}  // namespace

void split_cuts(ToolPath& path, std::vector<Cut>& cuts, const ReferencePath::Frames& frames,
                const std::vector<SplitPlace>& places, double over_burn) {
  // From the end, so that the places before stay where they are. Of a segment that was split, only
  // the part up to there is left for the places before.
  for (std::size_t i = places.size(); i-- > 0;) {
    SplitPlace place = places[i];
    if (i + 1 < places.size() && places[i + 1].segment == place.segment)
      place.s = std::min(1.0, place.s / places[i + 1].s);
    Splitter(path, cuts, frames, over_burn).split(place);
  }
}

}  // namespace smoothpost
