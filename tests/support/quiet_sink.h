#pragma once

#include "kernels/core/canonical_motion.h"

namespace smoothpost::test {

/// Ignores every call; tests override the ones that they look at.
struct QuietSink : CanonicalSink {
  void motion(const CanonicalMotion&) override {}
  void dwell(double, std::uint32_t) override {}
  void event(const ProcessEvent&) override {}
  void comment(std::string_view, std::uint32_t) override {}
  void tool_length(double, int, std::uint32_t) override {}
  void work_offset(const Vec3&, double, int, std::uint32_t) override {}
  void program_end(std::uint32_t) override {}
};

}  // namespace smoothpost::test
