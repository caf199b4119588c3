#include <cstddef>
#include <cstdint>
#include <string>

#include "formats/nc/dialect_detection.h"
#include "formats/nc/interpreter.h"
#include "formats/nc/parser.h"
#include "tests/fuzz/expect.h"

namespace {

using namespace smoothpost;

// Takes every call and expects finite numbers.
class Listener : public CanonicalSink {
 public:
  void motion(const CanonicalMotion& motion) override {
    for (const double value : motion.end) fuzz::expect(std::isfinite(value));
    for (const double value : motion.start) fuzz::expect(std::isfinite(value));
    fuzz::expect(motion.start_axis.allFinite() && motion.end_axis.allFinite());
    fuzz::expect(std::isfinite(motion.duration) && motion.duration >= 0.0);
    if (motion.is_arc)
      fuzz::expect(motion.arc.centre.allFinite() && std::isfinite(motion.arc.sweep));
  }
  void dwell(double seconds, std::uint32_t) override {
    fuzz::expect(std::isfinite(seconds) && seconds >= 0.0);
  }
  void event(const ProcessEvent& event) override { fuzz::expect(!event.name.empty()); }
  void comment(std::string_view, std::uint32_t) override {}
  void tool_length(double length, int, std::uint32_t) override {
    fuzz::expect(std::isfinite(length));
  }
  void work_offset(const Vec3& origin, double, int, std::uint32_t) override {
    fuzz::expect(origin.allFinite());
  }
  void program_end(std::uint32_t) override {}
};

nc::InterpreterSettings shop_settings() {
  nc::InterpreterSettings settings;
  settings.tool_lengths = {{1, 60.0}, {2, 80.0}};
  settings.run_budget = 5000;
  const auto row = [&](const char* event, const char* text) {
    EventWords words;
    words.event = event;
    words.text = text;
    settings.process.events.push_back(words);
  };
  row(event_name::kSpindleOn, "M3 S{rpm}");
  row(event_name::kSpindleOnReverse, "M4 S{rpm}");
  row(event_name::kSpindleOff, "M5");
  row(event_name::kToolChange, "T{tool} M6");
  row(event_name::kStop, "M0");
  row("coolant_on", "M8");
  row("coolant_off", "M9");
  row(event_name::kBeamOn, "M62 P0");
  row(event_name::kPower, "M67 E0 Q{percent}");
  row(event_name::kMessage, "(MSG, {text})");
  return settings;
}

}  // namespace

// In every dialect any bytes are parsed into pieces that print to the same bytes, and interpreted
// to a program of finite motions or to diagnostics.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string text(reinterpret_cast<const char*>(data), size);
  static const nc::InterpreterSettings kSettings = shop_settings();
  for (const nc::InputDialect dialect : {nc::InputDialect::linuxcnc, nc::InputDialect::fanuc,
                                         nc::InputDialect::haas, nc::InputDialect::siemens}) {
    const nc::ParsedProgram parsed = nc::parse(text, "fuzz.ngc", dialect);
    fuzz::expect(nc::print(parsed.program) == text);
    Listener listener;
    const auto summary = nc::interpret(parsed.program, kSettings, listener);
    fuzz::expect(summary.ok() != has_error(summary.diagnostics()));
  }
  nc::fitting_dialects(text);
  nc::is_heidenhain(text);
  return 0;
}
