#pragma once

#include <catch2/catch.hpp>
#include <string>

#include "postproc/pipeline/convert.h"
#include "postproc/pipeline/registry.h"

// Conversions that have to be certified, and what their programs say when they are read back.
namespace smoothpost::test {

inline Conversion converted(const ConvertInput& in) {
  Conversion c = convert(in, false, {});
  for (const auto& d : c.diagnostics) UNSCOPED_INFO(to_string(d));
  REQUIRE(c.verdict == Verdict::certified);
  return c;
}

/// By the dialect of the output machine.
inline ReadBack read_text(const ConvertInput& in, const std::string& text) {
  auto back = find_dialect(in.machine.dialect.name)->read_back(in.machine, text, "p");
  REQUIRE(back.ok());
  return back.value();
}

inline const Check& find(const Checks& checks, const std::string& name) {
  for (const auto& check : checks)
    if (check.name == name) return check;
  FAIL("no check " << name);
  return checks.front();
}

/// The same events in the same order, each where the joints are within `apart` of each other.
inline void check_same_events(const ReadBack& a, const ReadBack& b, double apart) {
  REQUIRE(a.events.size() == b.events.size());
  for (std::size_t k = 0; k < a.events.size(); ++k) {
    CHECK(a.events[k].name == b.events[k].name);
    REQUIRE((a.events[k].before > 0) == (b.events[k].before > 0));
    if (a.events[k].before == 0) continue;
    const auto place = [k](const ReadBack& r) { return r.moves[r.events[k].before - 1].to; };
    CHECK((place(a) - place(b)).cwiseAbs().maxCoeff() < apart);
  }
}

}  // namespace smoothpost::test
