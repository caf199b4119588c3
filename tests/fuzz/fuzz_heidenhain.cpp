#include <cstddef>
#include <cstdint>
#include <string_view>

#include "formats/heidenhain/reader.h"
#include "tests/fuzz/expect.h"

namespace {

using namespace smoothpost;

// Takes every call and expects finite numbers, unit axes and finite arcs.
class Listener : public CanonicalSink {
 public:
  void motion(const CanonicalMotion& motion) override {
    for (const double value : motion.end) fuzz::expect(std::isfinite(value));
    for (const double value : motion.start) fuzz::expect(std::isfinite(value));
    fuzz::expect(std::isfinite(motion.duration) && motion.duration >= 0.0);
    fuzz::expect(motion.arc.centre.allFinite() && std::isfinite(motion.arc.sweep));
    fuzz::expect(std::abs(motion.arc.normal.norm() - 1.0) < 1e-9);
    const double length = motion.end_axis.norm();
    fuzz::expect(length == 0.0 || std::abs(length - 1.0) < 1e-9);
  }
  void dwell(double seconds, std::uint32_t) override {
    fuzz::expect(std::isfinite(seconds) && seconds >= 0.0);
  }
  void event(const ProcessEvent& event) override { fuzz::expect(!event.name.empty()); }
  void comment(std::string_view, std::uint32_t) override {}
  void tool_length(double length, int, std::uint32_t) override {
    fuzz::expect(std::isfinite(length));
  }
  void work_offset(const Vec3& origin, double rotation, int, std::uint32_t) override {
    fuzz::expect(origin.allFinite() && std::isfinite(rotation));
  }
  void program_end(std::uint32_t) override {}
};

nc::InterpreterSettings shop_settings() {
  nc::InterpreterSettings settings;
  settings.run_budget = 20'000;
  settings.tool_lengths[1] = 60.0;
  settings.process.unmapped = UnmappedWords::comment;
  EventWords row;
  row.event = "beam_on";
  row.text = "M3 S{power}";
  settings.process.events.push_back(row);
  return settings;
}

}  // namespace

// Any bytes end in a program of finite motions or in diagnostics.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const nc::InterpreterSettings kShop = shop_settings();
  const std::string_view text(reinterpret_cast<const char*>(data), size);
  Listener listener;
  const auto result = conversational::read(text, "fuzz.h", kShop, listener);
  fuzz::expect(result.ok() != has_error(result.diagnostics()));
  return 0;
}
