#include "formats/cl/cycle.h"

#include <algorithm>
#include <cmath>

namespace smoothpost::cl {
namespace {

constexpr double kLargest = 1.0e6;        // mm
constexpr double kLongestDwell = 3600.0;  // s

bool is_any(std::string_view text, std::initializer_list<std::string_view> names) {
  return std::any_of(names.begin(), names.end(),
                     [&](std::string_view name) { return same_word(text, name); });
}

class CycleReader {
 public:
  CycleReader(std::span<const Item> items, double unit) : items_(items), unit_(unit) {}

  CycleReading read() {
    read_type();
    while (out_.problem.empty() && at_ < items_.size()) read_word();
    if (out_.problem.empty()) complete();
    if (out_.problem.empty()) out_.cycle = cycle_;
    return std::move(out_);
  }

 private:
  void fail(std::string problem, TextPlace place, bool refused = false) {
    out_.problem = std::move(problem);
    out_.place = place;
    out_.refused = refused;
  }

  void read_type() {
    const Item& item = items_[at_++];
    if (item.kind != Item::Kind::word)
      return fail("the type is expected behind CYCLE/, such as DRILL", item.place);
    if (is_any(item.text, {"DRILL", "FACE"})) return;
    if (read_pecks(item)) return;
    fail("the cycle " + quoted(item.text) +
             " is not read (read are DRILL, FACE, DEEP, DEEP2, BRKCHP); let the CAM system write "
             "its motions out",
         item.place, true);
  }

  bool read_pecks(const Item& item) {
    if (!is_any(item.text, {"DEEP", "DEEP2", "BRKCHP"})) return false;
    pecks_ = true;
    cycle_.break_chips = same_word(item.text, "BRKCHP");
    return true;
  }

  void read_word() {
    const Item& item = items_[at_++];
    if (item.kind != Item::Kind::word)
      return fail("a word such as FEDTO is expected, not " + quoted(item.text) +
                      " (values by their place are not read)",
                  item.place);
    const std::string_view name = item.text;
    const FeedUnit feed = feed_unit(name);
    if (read_pecks(item)) return;
    if (feed.known) {
      const double value = number(item);
      cycle_.feed = feed_of(value, feed, unit_);
      if (out_.problem.empty() && !usable(*cycle_.feed))
        return fail("the feed is outside 0.000001 to 1000000 mm/s or mm/rev", item.place);
    } else if (is_any(name, {"FEDTO", "DEPTH"})) {
      cycle_.depth = std::abs(length(item));
    } else if (is_any(name, {"RAPTO", "CLEAR"})) {
      cycle_.clearance = length(item);
      clearance_given_ = true;
    } else if (is_any(name, {"RTRCTO", "RETURN"})) {
      read_retract(item);
    } else if (same_word(name, "DWELL")) {
      cycle_.dwell = number(item);
      if (!(cycle_.dwell >= 0.0 && cycle_.dwell <= kLongestDwell))
        return fail("the dwell has to be 0 to 3600 s", item.place);
    } else if (is_any(name, {"STEP", "INCR", "1STPECK"})) {
      cycle_.first_peck = length(item);
      peck_place_ = item.place;
    } else if (same_word(name, "SUBPECK")) {
      cycle_.peck = length(item);
    } else {
      fail(quoted(name) + " in a cycle is not read; let the CAM system write its motions out",
           item.place, true);
    }
  }

  void read_retract(const Item& item) {
    if (at_ < items_.size() && same_word(items_[at_].text, "AUTO")) {
      ++at_;
      cycle_.retract_to_start = true;
    } else {
      cycle_.retract = length(item);
    }
  }

  double number(const Item& word) {
    if (at_ < items_.size() && items_[at_].kind == Item::Kind::number) return items_[at_++].value;
    fail("a number is expected behind " + quoted(word.text), word.place);
    return 0.0;
  }

  double length(const Item& word) {
    const double value = unit_ * number(word);
    if (out_.problem.empty() && !(std::abs(value) <= kLargest))
      fail(quoted(word.text) + " is beyond 1000000 mm", word.place);
    return value;
  }

  void complete() {
    const TextPlace place = items_.front().place;
    if (!(cycle_.depth > 0.0)) return fail("no depth: FEDTO or DEPTH above 0 is missing", place);
    if (!clearance_given_) return fail("no clearance: RAPTO or CLEAR is missing", place);
    if (cycle_.clearance < 0.0)
      return fail("the clearance (RAPTO, CLEAR) lies below the hole's mouth", place);
    if (cycle_.retract && *cycle_.retract < cycle_.clearance)
      return fail("RTRCTO lies below the clearance (RAPTO, CLEAR)", place);
    if (!pecks_) {
      if (cycle_.first_peck != 0.0 || cycle_.peck != 0.0)
        fail("a stroke depth in a cycle of one stroke; write DEEP or BRKCHP", place);
      return;
    }
    if (cycle_.peck == 0.0) cycle_.peck = cycle_.first_peck;
    if (!(cycle_.first_peck > 0.0 && cycle_.peck > 0.0))
      return fail("no depth of a stroke: STEP, INCR or 1STPECK above 0 is missing", place);
    if (cycle_.depth / std::min(cycle_.first_peck, cycle_.peck) > kMostPecks)
      fail("more than 1000 strokes a hole", peck_place_);
  }

  std::span<const Item> items_;
  double unit_;
  std::size_t at_ = 0;
  Cycle cycle_;
  bool pecks_ = false;
  bool clearance_given_ = false;
  TextPlace peck_place_;
  CycleReading out_;
};

}  // namespace

CycleReading read_cycle(std::span<const Item> items, double unit) {
  return CycleReader(items, unit).read();
}

std::vector<CycleStep> hole_steps(const Cycle& cycle, double retract) {
  std::vector<CycleStep> steps = {{retract, false, false}};
  if (retract > cycle.clearance) steps.push_back({cycle.clearance, false, false});
  double reached = 0.0;
  double stroke = cycle.first_peck > 0.0 ? cycle.first_peck : cycle.depth;
  while (reached + stroke < cycle.depth) {
    reached += stroke;
    steps.push_back({-reached, true, false});
    if (!cycle.break_chips) steps.push_back({cycle.clearance, false, false});
    steps.push_back({std::min(cycle.clearance, kPeckGap - reached), false, false});
    stroke = cycle.peck;
  }
  steps.push_back({-cycle.depth, true, cycle.dwell > 0.0});
  steps.push_back({retract, false, false});
  return steps;
}

}  // namespace smoothpost::cl
