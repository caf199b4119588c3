// Emission of joint words and reading them back, beside what a program can do at best in the same
// run: the same numbers printed as scaled integers, by std::to_chars and by snprintf.

#include <benchmark/benchmark.h>

#include <charconv>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <iterator>
#include <random>
#include <string>
#include <vector>

#include "kernels/core/units.h"
#include "machines/definition/machine_file.h"
#include "machines/dialects/decimal.h"
#include "machines/dialects/linuxcnc.h"

namespace {

using namespace smoothpost;

constexpr int kMoves = 100000;

MachineDefinition table_bc() {
  const std::string path =
      std::string(SMOOTHPOST_SOURCE_DIR) + "/machines/table_table_bc/machine.toml";
  std::ifstream in(path);
  const std::string text(std::istreambuf_iterator<char>(in), {});
  return parse_machine_file(text, path).value();
}

MachineProgram program(const MachineDefinition& machine) {
  MachineProgram out;
  std::mt19937 rng(1);
  for (int i = 0; i < kMoves; ++i) {
    MachineMove move;
    move.to.resize(machine.size());
    for (int j = 0; j < machine.size(); ++j) {
      const auto& joint = machine.axes[static_cast<std::size_t>(j)].joint;
      move.to[j] = std::uniform_real_distribution<double>(joint.lower, joint.upper)(rng);
    }
    move.joints = 0x1f;
    move.rapid = i == 0;
    move.duration = i == 0 ? 0.0 : 0.01 + 1e-7 * i;
    move.input_line = static_cast<std::uint32_t>(i);
    out.moves.push_back(move);
  }
  return out;
}

void emit(benchmark::State& state) {
  const auto machine = table_bc();
  const auto in = program(machine);
  std::size_t bytes = 0;
  for (auto _ : state) {
    const auto out = linuxcnc::emit(machine, in);
    bytes = out.value().text.size();
    benchmark::DoNotOptimize(out.value().text.data());
  }
  state.SetBytesProcessed(static_cast<std::int64_t>(state.iterations() * bytes));
}

void read_back(benchmark::State& state) {
  const auto machine = table_bc();
  const std::string text = linuxcnc::emit(machine, program(machine)).value().text;
  for (auto _ : state) {
    const auto read = linuxcnc::read_back(machine, text, "p");
    benchmark::DoNotOptimize(read.value().moves.data());
  }
  state.SetBytesProcessed(static_cast<std::int64_t>(state.iterations() * text.size()));
}

template <class Print>
void floor_of(benchmark::State& state, Print print) {
  const auto machine = table_bc();
  const auto in = program(machine);
  std::string text;
  for (auto _ : state) {
    text.clear();
    for (const auto& move : in.moves) {
      for (int j = 0; j < 5; ++j) {
        text += ' ';
        text += "XYZBC"[j];
        print(text, j < 3 ? move.to[j] : degrees_from_radians(move.to[j]), j < 3 ? 5 : 6);
      }
      text += '\n';
    }
    benchmark::DoNotOptimize(text.data());
  }
  state.SetBytesProcessed(static_cast<std::int64_t>(state.iterations() * text.size()));
}

void floor_scaled_integers(benchmark::State& state) {
  floor_of(state, [](std::string& text, double value, int digits) {
    append_decimal(text, value, digits);
  });
}
void floor_to_chars(benchmark::State& state) {
  floor_of(state, [](std::string& text, double value, int digits) {
    char buffer[64];
    const auto end =
        std::to_chars(buffer, buffer + 64, value, std::chars_format::fixed, digits).ptr;
    text.append(buffer, end);
  });
}
void floor_snprintf(benchmark::State& state) {
  floor_of(state, [](std::string& text, double value, int digits) {
    char buffer[64];
    text.append(buffer, static_cast<std::size_t>(std::snprintf(buffer, 64, "%.*f", digits, value)));
  });
}

BENCHMARK(emit)->Unit(benchmark::kMillisecond);
BENCHMARK(read_back)->Unit(benchmark::kMillisecond);
BENCHMARK(floor_scaled_integers)->Unit(benchmark::kMillisecond);
BENCHMARK(floor_to_chars)->Unit(benchmark::kMillisecond);
BENCHMARK(floor_snprintf)->Unit(benchmark::kMillisecond);

}  // namespace

BENCHMARK_MAIN();
