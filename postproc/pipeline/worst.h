#pragma once

#include <cmath>
#include <cstdint>
#include <string>
#include <utility>

#include "kernels/core/check.h"

namespace smoothpost {

/// The check with the largest value wins its place.
class Worst {
 public:
  void see(double value, std::uint32_t output_line, double time, std::uint32_t input_line = 0) {
    // What is not a number stays: it must fail, never be passed over.
    if (seen_ && (std::isnan(value_) || value <= value_)) return;
    seen_ = true;
    value_ = value;
    output_line_ = output_line;
    time_ = time;
    input_line_ = input_line;
  }
  bool seen() const { return seen_; }
  double value() const { return value_; }
  Check check(std::string name, double limit, std::string unit) const {
    Check c;
    c.name = std::move(name);
    c.value = value_;
    c.limit = limit;
    c.unit = std::move(unit);
    c.ok = std::isfinite(value_) && value_ <= limit;
    c.output_line = output_line_;
    c.input_line = input_line_;
    c.time_s = time_;
    return c;
  }

 private:
  bool seen_ = false;
  double value_ = 0.0;
  std::uint32_t output_line_ = 0;
  std::uint32_t input_line_ = 0;
  double time_ = 0.0;
};

}  // namespace smoothpost
