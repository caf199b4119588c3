#include <cstddef>
#include <cstdint>
#include <string_view>

#include "formats/cl/reader.h"
#include "tests/fuzz/expect.h"

namespace {

using namespace smoothpost;

// Takes every call and expects finite numbers, unit axes and finite arcs.
class Listener : public CanonicalSink {
 public:
  void motion(const CanonicalMotion& motion) override {
    for (const double value : motion.end) fuzz::expect(std::isfinite(value));
    for (const double value : motion.start) fuzz::expect(std::isfinite(value));
    fuzz::expect(std::abs(motion.end_axis.norm() - 1.0) < 1e-9);
    fuzz::expect(motion.start_axis.allFinite());
    fuzz::expect(std::isfinite(motion.duration) && motion.duration >= 0.0);
    fuzz::expect(motion.arc.centre.allFinite() && std::isfinite(motion.arc.sweep));
    fuzz::expect(std::abs(motion.arc.normal.norm() - 1.0) < 1e-9);
  }
  void dwell(double seconds, std::uint32_t) override {
    fuzz::expect(std::isfinite(seconds) && seconds >= 0.0);
  }
  void event(const ProcessEvent& event) override { fuzz::expect(!event.name.empty()); }
  void comment(std::string_view, std::uint32_t) override {}
  void tool_length(double, int, std::uint32_t) override { fuzz::expect(false); }
  void work_offset(const Vec3&, double, int, std::uint32_t) override { fuzz::expect(false); }
  void program_end(std::uint32_t) override {}
};

cl::ReaderSettings shop_settings() {
  cl::ReaderSettings settings;
  settings.unit = 25.4;
  settings.feed = 10.0;
  settings.frames = cl::FrameRule::applied;
  settings.process.unmapped = UnmappedWords::comment;
  for (const auto& [event, text] : {std::pair<const char*, const char*>{"beam_on", "AUXFUN/10"},
                                    {"power", "AUXFUN/{n},{percent}"},
                                    {"message", "PPRINT/{text}"}}) {
    EventWords words;
    words.event = event;
    words.text = text;
    settings.process.events.push_back(words);
  }
  return settings;
}

}  // namespace

// Any bytes end in a program of finite motions or in diagnostics, with all that a user may say and
// with nothing of it.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const cl::ReaderSettings kShop = shop_settings();
  const std::string_view text(reinterpret_cast<const char*>(data), size);
  for (const cl::ReaderSettings& settings : {kShop, cl::ReaderSettings{}}) {
    Listener listener;
    const auto result = cl::read(text, "fuzz.apt", settings, listener);
    fuzz::expect(result.ok() != has_error(result.diagnostics()));
  }
  return 0;
}
