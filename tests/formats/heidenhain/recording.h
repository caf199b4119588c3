#pragma once

#include <string>
#include <vector>

#include "formats/heidenhain/reader.h"
#include "formats/nc/number_text.h"
#include "tests/formats/cl/recording.h"

// What the tests of this component share: the sink of CL data, and a run of one text.
namespace smoothpost::test {

struct Conversational {
  ClSink sink;
  bool ok = false;
  Diagnostics diagnostics;
  conversational::ReadingSummary summary;

  std::vector<std::string> errors() const {
    std::vector<std::string> out;
    for (const Diagnostic& d : diagnostics)
      if (d.severity == Severity::error) out.push_back(d.code);
    return out;
  }
  bool has(std::string_view code) const {
    return std::any_of(diagnostics.begin(), diagnostics.end(),
                       [&](const Diagnostic& d) { return d.code == code; });
  }
  std::string all_text() const {
    std::string out;
    for (const Diagnostic& d : diagnostics) out += to_string(d) + "\n";
    return out;
  }
  /// "x y z" of each motion's end, at most four decimals, the kind in front: r, f or a.
  std::vector<std::string> places() const {
    std::vector<std::string> out;
    for (const CanonicalMotion& m : sink.motions) {
      std::string text = m.is_arc ? "a" : m.kind == MotionKind::rapid ? "r" : "f";
      for (int i = 0; i < 3; ++i)
        text += " " + nc::decimal_text(m.end[static_cast<std::size_t>(i)], 4);
      out.push_back(text);
    }
    return out;
  }
};

inline Conversational read_program(const std::string& text,
                                   const nc::InterpreterSettings& settings = {}) {
  Conversational out;
  const auto result = conversational::read(text, "t.h", settings, out.sink);
  out.ok = result.ok();
  out.diagnostics = result.diagnostics();
  if (result.ok()) out.summary = result.value();
  return out;
}

/// Blocks of a program in mm that begins with a rapid to X0 Y0 Z10 and the feed 600.
inline Conversational read_blocks(const std::string& blocks,
                                  const nc::InterpreterSettings& settings = {}) {
  return read_program(
      "0 BEGIN PGM T MM\n1 L X+0 Y+0 Z+10 FMAX\n2 L F600\n" + blocks + "\n999 END PGM T MM\n",
      settings);
}

}  // namespace smoothpost::test
