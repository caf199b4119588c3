#include <benchmark/benchmark.h>

#include <cstdio>
#include <cstring>
#include <ctime>
#include <random>
#include <string>
#include <utility>

#include "formats/nc/interpreter.h"
#include "formats/nc/parser.h"
#include "formats/nc/program_stream.h"
#include "tests/support/quiet_sink.h"

// Reading NC text: parse() alone, parse() with interpret(), the same in windows (what a conversion
// does), and two floors of the same run:
// counting lines by memchr, and a bare scan of "letter number" that checks no grammar. Counters:
// MB/s of text, and `of_digits`, the share of the digit scan's speed measured just before.
namespace {

using namespace smoothpost;

std::string decimal(double value) {
  char buffer[40];
  std::snprintf(buffer, sizeof buffer, "%.4f", value);
  return buffer;
}

/// 1,000,003 lines "G1 X.. Y.. Z.. A.. C.. F..", about 55 MB.
const std::string& five_axis_program() {
  static const std::string text = [] {
    std::mt19937 random(1);
    std::uniform_real_distribution<double> mm(-400.0, 400.0), deg(-180.0, 180.0),
        feed(500.0, 5000.0);
    std::string out = "%\nG21 G90 G94\n";
    out.reserve(60'000'000);
    for (int i = 0; i < 1'000'000; ++i) {
      out += "G1 X" + decimal(mm(random)) + " Y" + decimal(mm(random)) + " Z" +
             decimal(mm(random)) + " A" + decimal(deg(random)) + " C" + decimal(deg(random)) +
             " F" + std::to_string(static_cast<int>(feed(random))) + "\n";
    }
    return out + "M2\n";
  }();
  return text;
}

/// The same number of lines of a modal three-axis program.
const std::string& three_axis_program() {
  static const std::string text = [] {
    std::mt19937 random(2);
    std::uniform_real_distribution<double> mm(-400.0, 400.0);
    std::string out = "%\nG21 G90 G94 G1 F2000\n";
    out.reserve(40'000'000);
    for (int i = 0; i < 1'000'000; ++i) {
      out += "X" + decimal(mm(random)) + " Y" + decimal(mm(random));
      if (i % 3 == 0) out += " Z" + decimal(mm(random));
      out += "\n";
    }
    return out + "M2\n";
  }();
  return text;
}

struct TimeSink final : test::QuietSink {
  double sum = 0.0;
  void motion(const CanonicalMotion& m) override { sum += m.duration; }
};

std::size_t count_lines(const std::string& text) {
  std::size_t lines = 0;
  const char* p = text.data();
  const char* const end = p + text.size();
  while (p != end) {
    const auto* found =
        static_cast<const char*>(std::memchr(p, '\n', static_cast<std::size_t>(end - p)));
    if (!found) break;
    ++lines;
    p = found + 1;
  }
  return lines;
}

/// Letter and number, nothing else; the sum keeps the compiler from leaving it out.
double digit_scan(const std::string& text) {
  static constexpr double kPowers[] = {1, 1e1, 1e2, 1e3, 1e4, 1e5, 1e6, 1e7, 1e8, 1e9};
  double sum = 0.0;
  const char* p = text.data();
  const char* const end = p + text.size();
  while (p != end) {
    const char c = *p++;
    if (c < 'A' || c > 'Z') continue;
    bool negative = false;
    if (p != end && *p == '-') {
      negative = true;
      ++p;
    }
    std::int64_t m = 0;
    while (p != end && static_cast<unsigned char>(*p - '0') <= 9) m = m * 10 + (*p++ - '0');
    int decimals = 0;
    if (p != end && *p == '.') {
      ++p;
      while (p != end && static_cast<unsigned char>(*p - '0') <= 9) {
        m = m * 10 + (*p++ - '0');
        ++decimals;
      }
    }
    const double value = static_cast<double>(m) / kPowers[decimals];
    sum += negative ? -value : value;
  }
  return sum;
}

double g_digit_rate[2] = {0.0, 0.0};  // MB/s of the last digit scan, by program

const std::string& program(int which) {
  return which == 0 ? five_axis_program() : three_axis_program();
}

void set_counters(benchmark::State& state, double seconds) {
  const int which = static_cast<int>(state.range(0));
  const double megabytes = 1e-6 * static_cast<double>(program(which).size());
  const double rate = megabytes * static_cast<double>(state.iterations()) / seconds;
  state.counters["MB"] = megabytes;
  state.counters["MB_per_s"] = rate;
  if (g_digit_rate[which] > 0.0) state.counters["of_digits"] = rate / g_digit_rate[which];
}

/// Runs `work` on the chosen program and takes the processor time itself: the ratio to the floor
/// then holds on a machine that others use too.
template <class Work>
double timed(benchmark::State& state, Work work) {
  const std::string& text = program(static_cast<int>(state.range(0)));
  double seconds = 0.0;
  for (auto _ : state) {
    std::string own = text;  // a reader hands its text over
    const std::clock_t begin = std::clock();
    work(own);
    const double passed =
        static_cast<double>(std::clock() - begin) / static_cast<double>(CLOCKS_PER_SEC);
    seconds += passed;
    state.SetIterationTime(passed);
  }
  set_counters(state, seconds);
  return seconds;
}

void floor_lines(benchmark::State& state) {
  timed(state, [](std::string& text) { benchmark::DoNotOptimize(count_lines(text)); });
}

void floor_digits(benchmark::State& state) {
  const double seconds =
      timed(state, [](std::string& text) { benchmark::DoNotOptimize(digit_scan(text)); });
  const int which = static_cast<int>(state.range(0));
  g_digit_rate[which] = 1e-6 * static_cast<double>(program(which).size()) *
                        static_cast<double>(state.iterations()) / seconds;
  state.counters["of_digits"] = 1.0;
}

void parse_only(benchmark::State& state) {
  timed(state, [&](std::string& text) {
    const nc::ParsedProgram parsed = nc::parse(std::move(text), "p.ngc");
    benchmark::DoNotOptimize(parsed.program.pieces.data());
    state.counters["pieces"] = static_cast<double>(parsed.program.pieces.size());
  });
}

void parse_and_interpret(benchmark::State& state) {
  timed(state, [&](std::string& text) {
    const nc::ParsedProgram parsed = nc::parse(std::move(text), "p.ngc");
    TimeSink sink;
    const auto result = nc::interpret(parsed.program, {}, sink);
    if (!result.ok()) state.SkipWithError("the program was refused");
    benchmark::DoNotOptimize(sink.sum);
  });
}

void read_in_windows(benchmark::State& state) {
  timed(state, [&](std::string& text) {
    nc::ProgramStream stream(std::move(text), "p.ngc", nc::InputDialect::linuxcnc, {});
    TimeSink sink;
    const auto result = nc::interpret(stream, {}, sink);
    if (!result.ok()) state.SkipWithError("the program was refused");
    benchmark::DoNotOptimize(sink.sum);
  });
}

// Argument 0: five-axis, 1: three-axis modal.
BENCHMARK(floor_lines)->Arg(0)->Arg(1)->UseManualTime()->Unit(benchmark::kMillisecond);
BENCHMARK(floor_digits)->Arg(0)->Arg(1)->UseManualTime()->Unit(benchmark::kMillisecond);
BENCHMARK(parse_only)->Arg(0)->Arg(1)->UseManualTime()->Unit(benchmark::kMillisecond);
BENCHMARK(parse_and_interpret)->Arg(0)->Arg(1)->UseManualTime()->Unit(benchmark::kMillisecond);
BENCHMARK(read_in_windows)->Arg(0)->Arg(1)->UseManualTime()->Unit(benchmark::kMillisecond);

}  // namespace

BENCHMARK_MAIN();
