#include "formats/nc/siemens_cycles.h"

#include <algorithm>
#include <cmath>

#include "formats/nc/number_text.h"
#include "kernels/core/units.h"

namespace smoothpost::nc {
namespace {

using Kind = DrillStep::Kind;

constexpr std::size_t kMostPecks = 100'000;
constexpr double kMostHoles = 100'000.0;
constexpr double kNoStroke = 1e-9;  // mm

/// What a cycle takes behind DPR, as names for messages.
struct Signature {
  std::string_view name;
  std::size_t values;
};
constexpr Signature kSignatures[] = {{"CYCLE81", 5},   {"CYCLE82", 6}, {"CYCLE83", 17},
                                     {"CYCLE840", 11}, {"CYCLE85", 8}, {"CYCLE86", 11},
                                     {"CYCLE87", 6},   {"CYCLE88", 7}, {"CYCLE89", 6}};

class Cycle {
 public:
  Cycle(std::string_view name, const CycleValues& values, double unit)
      : name_(name), values_(values), unit_(unit) {}

  DrillingCycle read() {
    if (name_ == "CYCLE84") {
      return {{},
              "rigid tapping ties the feed to the turning of the spindle, which the planned "
              "motion does not follow; keep this operation on its control"};
    }
    for (const Signature& signature : kSignatures) {
      if (signature.name == name_) known_ = signature.values;
    }
    for (std::size_t i = known_; i < values_.size(); ++i) {
      if (number(i) != 0.0) {
        return {{}, "its further arguments, which say how the others count, are read as 0 only"};
      }
    }
    heights();
    if (problem_.empty()) steps();
    return {std::move(call_), std::move(problem_)};
  }

 private:
  bool given(std::size_t i) const { return i < values_.size() && values_[i].has_value(); }
  double number(std::size_t i) const { return given(i) ? *values_[i] : 0.0; }
  double length(std::size_t i) const { return number(i) * unit_; }
  void fail(std::string problem) {
    if (problem_.empty()) problem_ = std::move(problem);
  }

  void heights() {
    if (!given(0) || !given(1) || (!given(3) && !given(4))) {
      return fail("RTP, RFP and DP or DPR are needed");
    }
    reference_ = length(1);
    call_.depth = given(4) ? reference_ - std::abs(length(4)) : length(3);
    call_.clearance = reference_ + std::abs(length(2));
    call_.retract = length(0);
    if (!(call_.depth < reference_) || call_.retract < call_.clearance) {
      fail("the depth has to be below RFP, and RTP not below RFP and SDIS");
    }
  }

  void add(Kind kind, double value) { call_.steps.push_back({kind, value, 1.0, 0.0}); }
  void dwell(double seconds) {
    if (seconds < 0.0) fail("a dwell in turns of the spindle is not read; write seconds");
    if (seconds > 0.0) add(Kind::dwell, seconds);
  }

  /// M3 or M4 from an argument.
  double direction(std::size_t i, const char* name) {
    const double m = number(i);
    if (m != 3.0 && m != 4.0) fail(std::string(name) + " has to be 3 or 4, for M3 or M4");
    return m;
  }

  void steps() {
    if (name_ == "CYCLE83") {
      deep();
    } else if (name_ == "CYCLE840") {
      tap();
    } else if (name_ == "CYCLE85") {
      ream();
    } else if (name_ == "CYCLE86") {
      bore();
    } else {
      plain();
    }
    add(Kind::rapid, call_.retract);
  }

  /// 81, 82, 87, 88, 89.
  void plain() {
    const bool stops = name_ == "CYCLE87" || name_ == "CYCLE88";
    if (stops) add(Kind::m_word, direction(name_ == "CYCLE87" ? 5 : 6, "SDIR"));
    add(Kind::feed, call_.depth);
    if (name_ != "CYCLE81" && name_ != "CYCLE87") dwell(number(5));
    if (stops) {
      add(Kind::m_word, 5.0);
      add(Kind::m_word, 0.0);
    }
    if (name_ == "CYCLE89") add(Kind::feed, call_.clearance);
  }

  void ream() {
    if (!(number(6) > 0.0) || !(number(7) > 0.0)) return fail("FFR and RFF, the feeds, are needed");
    add(Kind::feed, call_.depth);
    call_.steps.back().rate = length(6);
    dwell(number(5));
    add(Kind::feed, call_.clearance);
    call_.steps.back().rate = length(7);
  }

  void bore() {
    if (number(7) != 0.0 || number(8) != 0.0 || number(9) != 0.0) {
      return fail(
          "RPA, RPO and RPAP lift the tool at an angle of the spindle (POSS), which the "
          "process table cannot say; write them as 0");
    }
    add(Kind::m_word, direction(6, "SDIR"));
    add(Kind::feed, call_.depth);
    dwell(number(5));
    add(Kind::m_word, 19.0);
    add(Kind::rapid, call_.clearance);
  }

  void tap() {
    if (number(8) != 1.0 || number(9) != 0.0 || number(10) != 0.0) {
      return fail(
          "tapping with an encoder or with a pitch ties the feed to the turning of the "
          "spindle, which the planned motion does not follow; only ENC = 1 without MPIT "
          "and PIT is read, for a compensating holder");
    }
    const double back = direction(6, "SDR");
    const double on = direction(7, "SDAC");
    if (back == on) return fail("SDR, the way back, has to differ from SDAC");
    call_.spindle = static_cast<int>(on);
    add(Kind::feed, call_.depth);
    dwell(number(5));
    add(Kind::m_word, back);
    add(Kind::feed, call_.clearance);
    add(Kind::m_word, on);
  }

  /// FDEP, FDPR, DAM, DTB, DTS, FRF, VARI, AXN, MDEP, VRT, DTD, DIS1 behind DPR.
  void deep() {
    const double total = reference_ - call_.depth;
    const bool relative = number(6) != 0.0;
    const double first = relative ? std::abs(length(6)) : reference_ - length(5);
    if (!relative && !given(5)) return fail("FDEP or FDPR, the first depth, is needed");
    if (relative && number(5) != 0.0 && std::abs(reference_ - length(5) - first) > 1e-6) {
      return fail("FDEP and FDPR name two first depths");
    }
    if (!(first > 0.0) || first > total + kNoStroke) {
      return fail("the first depth has to be below RFP and not below the whole depth");
    }
    const double less = number(7) < 0.0 ? number(7) : length(7);
    const double smallest = length(13);
    if (less < 0.0 && (less < -1.0 || !(smallest > 0.0))) {
      return fail("a factor DAM from -1 to 0 needs MDEP, the smallest stroke");
    }
    if (less >= 0.0 && smallest != 0.0) return fail("MDEP is read with a factor DAM below 0 only");
    if (number(12) != 0.0 && number(12) != 3.0) return fail("AXN, another axis, is read as 0 or 3");
    const double factor = given(10) && number(10) != 0.0 ? number(10) : 1.0;
    if (!(factor > 0.0) || factor > 1.0) return fail("FRF, a factor of the feed, is from 0 to 1");
    const double variant = number(11);
    if (variant != 0.0 && variant != 1.0) return fail("VARI is 0 (chip breaking) or 1");
    if (number(14) < 0.0 || number(16) < 0.0) return fail("VRT and DIS1 are lengths from 0");
    const auto depths = peck_depths(total, std::min(first, total), less, smallest);
    if (depths.empty()) return fail("more than 100000 strokes");
    call_.pecks = true;
    const double lead = number(16) > 0.0 ? length(16)
                        : total <= 30.0  ? 0.6
                                         : std::min(total / 50.0, 7.0);
    const double lift = number(14) > 0.0 ? length(14) : 1.0;
    for (std::size_t k = 0; k < depths.size(); ++k) {
      const double height = k + 1 == depths.size() ? call_.depth : reference_ - depths[k];
      add(Kind::feed, height);
      if (k == 0) call_.steps.back().factor = factor;
      const bool last = k + 1 == depths.size();
      dwell(last && number(15) != 0.0 ? number(15) : number(8));
      if (last) break;
      if (variant == 0.0) {
        add(Kind::feed, height + lift);
      } else {
        add(Kind::rapid, call_.clearance);
        dwell(number(9));
        add(Kind::rapid, std::min(height + lead, call_.clearance));
      }
    }
  }

  std::string_view name_;
  const CycleValues& values_;
  double unit_;
  std::size_t known_ = 0;
  double reference_ = 0.0;
  DrillingCall call_;
  std::string problem_;
};

}  // namespace

DrillingCycle drilling_cycle(std::string_view name, const CycleValues& values, double unit) {
  return Cycle(name, values, unit).read();
}

std::vector<double> peck_depths(double total, double first, double less, double smallest) {
  std::vector<double> depths{first};
  double stroke = first;
  while (depths.back() < total - kNoStroke) {
    if (depths.size() >= kMostPecks) return {};
    const double left = total - depths.back();
    if (less > 0.0) stroke = std::max(stroke - less, less);
    if (less < 0.0) stroke = std::max(-less * stroke, smallest);
    if (less > 0.0 && stroke == less && left > less && left <= 2.0 * less) {
      depths.push_back(depths.back() + 0.5 * left);
      depths.push_back(total);
    } else {
      depths.push_back(depths.back() + std::min(stroke, left));
    }
  }
  depths.back() = total;
  return depths;
}

HolePattern hole_pattern(std::string_view name, const CycleValues& values, double unit) {
  HolePattern out;
  for (std::size_t i = 0; i < values.size(); ++i) {
    if (i >= 6 && values[i].value_or(0.0) != 0.0) {
      out.problem = "its further arguments are read as 0 only";
    }
  }
  const auto number = [&](std::size_t i) {
    return i < values.size() ? values[i].value_or(0.0) : 0.0;
  };
  const double count = number(5);
  if (count != std::trunc(count) || count < 1.0 || count > kMostHoles) {
    out.problem = "NUM, the count of holes, is a whole number from 1 to 100000";
  }
  const bool circle = name == "HOLES2";
  if (circle && !(number(2) > 0.0)) out.problem = "RAD, the radius, has to be above 0";
  if (!circle && (number(3) < 0.0 || number(4) < 0.0)) {
    out.problem = "FDIS and DBH are distances from 0";
  }
  if (!out.problem.empty()) return out;
  const double step = circle && number(4) == 0.0 ? 360.0 / count : number(4);
  for (double k = 0.0; k < count; k += 1.0) {
    const double angle = radians_from_degrees(circle ? number(3) + k * step : number(2));
    const double reach = circle ? number(2) : number(3) + k * step;
    out.places.emplace_back((number(0) + reach * std::cos(angle)) * unit,
                            (number(1) + reach * std::sin(angle)) * unit);
  }
  return out;
}

}  // namespace smoothpost::nc
