// Whole conversions from text in memory to a certified program in memory, with growth in size,
// beside a floor: the closed form and forward kinematics of as many poses as the certificate looked
// at.

#include <benchmark/benchmark.h>

#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>

#include "kernels/kinematics/rotary_pair.h"
#include "machines/definition/machine_file.h"
#include "postproc/pipeline/convert.h"

namespace {

using namespace smoothpost;
namespace fs = std::filesystem;

std::string bytes(const fs::path& path) {
  std::ifstream in(path, std::ios::binary);
  return std::string(std::istreambuf_iterator<char>(in), {});
}

MachineDefinition machine(const std::string& name) {
  const fs::path path = fs::path(SMOOTHPOST_SOURCE_DIR) / "machines" / name / "machine.toml";
  return parse_machine_file(bytes(path), name).value();
}

// A five-axis program of n cutting blocks on the A/C table.
std::string generated(int n) {
  std::string text = "%\nM428\nG21 G90 G94\nG0 X0 Y0 Z30 A0 C0\nG0 A-20 C0\n";
  char line[128];
  for (int i = 0; i < n; ++i) {
    const double t = 0.01 * i;
    std::snprintf(line, sizeof line, "G1 X%.3f Y%.3f Z%.3f A%.3f C%.3f F600\n", 30 * std::cos(t),
                  30 * std::sin(t), 2 * std::sin(3 * t), -20 - 5 * std::sin(2 * t),
                  10 * std::sin(t));
    text += line;
  }
  return text + "G0 Z60\nM429\nM30\n%\n";
}

Conversion run(const std::string& text, const char* from, const char* to, int tool) {
  InputSettings settings;
  settings.file_name = "bench.ngc";
  settings.machine = machine(from);
  if (tool > 0) settings.tool_lengths[tool] = 50.0;
  ConvertInput in;
  in.input = std::move(interpret_nc(text, settings).value());
  in.machine = machine(to);
  in.input_name = "bench.ngc";
  return convert(in, false, {});
}

void convert_generated(benchmark::State& state) {
  const std::string text = generated(static_cast<int>(state.range(0)));
  std::size_t blocks = 0;
  for (auto _ : state) {
    const Conversion c = run(text, "table_table_ac", "table_table_bc", 0);
    if (c.verdict != Verdict::certified) state.SkipWithError("not certified");
    blocks = c.blocks;
  }
  state.counters["blocks"] = static_cast<double>(blocks);
  state.counters["us_per_block"] = benchmark::Counter(
      1e-6 * static_cast<double>(blocks) * static_cast<double>(state.iterations()),
      benchmark::Counter::kIsRate | benchmark::Counter::kInvert);
  state.SetComplexityN(state.range(0));
}

// The two boat programs of LinuxCNC, where the shared corpus lies beside the checkout.
void convert_boat(benchmark::State& state, const char* name, const char* from, int tool) {
  const fs::path path = fs::path(SMOOTHPOST_SOURCE_DIR).parent_path() /
                        "shared/corpus/1_five_axis/LinuxCNC/configs/sim/axis/vismach/5axis/"
                        "table-rotary-tilting/demos" /
                        name;
  if (!fs::exists(path)) {
    state.SkipWithError("the corpus is not here");
    return;
  }
  const std::string text = bytes(path);
  for (auto _ : state)
    if (run(text, from, "table_table_bc", tool).verdict != Verdict::certified)
      state.SkipWithError("not certified");
}

// Two closed forms and twelve forward kinematics a block: about what plan and certificate ask for.
void floor_kinematics(benchmark::State& state) {
  const MachineDefinition m = machine("table_table_bc");
  const ScrewChain chain = chain_of(m);
  const auto pair = RotaryPair::from(chain);
  const JointVector held = home_of(m);
  CutterLocation location{Vec3(10, 20, 30), Vec3(0.3, 0.2, 0.9).normalized()};
  for (auto _ : state)
    for (std::int64_t i = 0; i < state.range(0); ++i) {
      location.tip.x() = 1e-3 * static_cast<double>(i);
      for (int k = 0; k < 2; ++k) benchmark::DoNotOptimize(pair->solve(location, held));
      for (int k = 0; k < 12; ++k) benchmark::DoNotOptimize(forward_location(chain, held));
    }
}

BENCHMARK(convert_generated)
    ->Arg(1000)
    ->Arg(10000)
    ->Arg(100000)
    ->Unit(benchmark::kMillisecond)
    ->Complexity();
BENCHMARK(floor_kinematics)->Arg(10000)->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(convert_boat, boat_xyzac, "boat-xyzac.ngc", "table_table_ac", 0)
    ->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(convert_boat, boat_xyzbc, "boat-xyzbc.ngc", "table_table_bc", 1)
    ->Unit(benchmark::kMillisecond);

}  // namespace

BENCHMARK_MAIN();
