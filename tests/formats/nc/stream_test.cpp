#include <malloc.h>

#include <algorithm>
#include <catch2/catch.hpp>
#include <cstring>
#include <filesystem>
#include <memory>
#include <random>

#include "formats/nc/program_stream.h"
#include "kernels/core/contract.h"
#include "tests/formats/nc/recording.h"
#include "tests/support/quiet_sink.h"
#include "tests/support/support.h"

// A program that is parsed while it runs, against the same program parsed as a whole.
namespace smoothpost::test {
namespace {

struct Sizes {
  std::size_t window, kept;
};
// Those of programs that jump have an eighth of it: one block, one, three, 512.
constexpr Sizes kSizes[] = {{1, 0}, {7, 3}, {24, 1}, {4096, 256}};
constexpr nc::InputDialect kDialects[] = {nc::InputDialect::linuxcnc, nc::InputDialect::fanuc,
                                          nc::InputDialect::haas, nc::InputDialect::siemens};

/// Every bit of every call, in order.
struct Trace final : CanonicalSink {
  std::uint64_t hash = 1469598103934665603u;
  std::size_t calls = 0;

  void bytes(const void* data, std::size_t size) {
    const auto* p = static_cast<const unsigned char*>(data);
    for (std::size_t i = 0; i < size; ++i) hash = (hash ^ p[i]) * 1099511628211u;
  }
  template <class... Values>
  void add(const Values&... values) {
    ++calls;
    (bytes(&values, sizeof values), ...);
  }
  void text(std::string_view words) {
    add(words.size());
    bytes(words.data(), words.size());
  }
  void motion(const CanonicalMotion& m) override {
    add('m', m.kind, m.is_arc, m.tcp, m.axis_vector, m.probe, m.machine_position, m.unknown_start,
        m.unknown_end, m.programmed, m.line, m.column, m.duration, m.pitch, m.start, m.end);
    for (const Vec3& v : {m.start_axis, m.end_axis, m.arc.centre, m.arc.normal})
      add(v[0], v[1], v[2]);
    add(m.arc.sweep);
  }
  void dwell(double seconds, std::uint32_t line) override { add('d', seconds, line); }
  void event(const ProcessEvent& e) override {
    add('e', e.line, e.column);
    text(e.name);
    for (const auto& [name, value] : e.parameters) {
      text(name);
      text(value);
    }
  }
  void comment(std::string_view words, std::uint32_t line) override {
    add('c', line);
    text(words);
  }
  void tool_length(double length, int tool, std::uint32_t line) override {
    add('t', length, tool, line);
  }
  void work_offset(const Vec3& p, double rotation, int system, std::uint32_t line) override {
    add('o', p[0], p[1], p[2], rotation, system, line);
  }
  void program_end(std::uint32_t line) override { add('p', line); }
};

std::string listed(const Diagnostics& diagnostics) {
  std::string out;
  for (const Diagnostic& d : diagnostics) out += to_string(d) + "\n";
  return out;
}

std::string told(const nc::InterpretationSummary& s) {
  std::string out =
      std::to_string(s.uses_tcp) + std::to_string(s.uses_rotary) + std::to_string(s.ended);
  for (const int tool : s.tools) out += " T" + std::to_string(tool);
  for (const int system : s.work_systems) out += " W" + std::to_string(system);
  for (const auto& file : s.files) out += " " + file.name;
  return out;
}

struct Reading {
  std::string
      text;  ///< diagnostics of the text, what is known of it, diagnostics and sum of the run
  std::uint64_t hash = 0;
  std::size_t calls = 0;
  bool operator==(const Reading&) const = default;
};

Reading reading(const nc::Program& program, const Diagnostics& of_text,
                const Result<nc::InterpretationSummary>& result, const Trace& trace) {
  Reading out{listed(of_text) + "\n", trace.hash, trace.calls};
  for (const std::size_t number :
       {program.block_count, static_cast<std::size_t>(program.jumps()),
        static_cast<std::size_t>(program.first_fault), static_cast<std::size_t>(program.end_block)})
    out.text += std::to_string(number) + " ";
  for (const nc::LateFault& f : program.late_faults)
    out.text += std::to_string(f.line) + ":" + std::to_string(f.column) + f.code + f.text;
  out.text += "\n" + listed(result.diagnostics());
  if (result.ok()) out.text += told(result.value());
  return out;
}

Reading read_whole(const std::string& text, const nc::InterpreterSettings& settings,
                   nc::InputDialect dialect) {
  const nc::ParsedProgram parsed = nc::parse(text, "t.nc", dialect);
  Trace trace;
  const auto result = nc::interpret(parsed.program, settings, trace);
  return reading(parsed.program, parsed.diagnostics, result, trace);
}

struct Seen {
  std::size_t texts = 0, calls = 0, ok = 0, windowed = 0, jumping = 0, faulty = 0, restarted = 0;
};

/// The same reading in windows of every size.
void require_same(const std::string& text, const nc::InterpreterSettings& settings,
                  nc::InputDialect dialect, Seen& seen) {
  const Reading whole = read_whole(text, settings, dialect);
  ++seen.texts;
  seen.calls += whole.calls;
  for (const auto& [window, kept] : kSizes) {
    std::string printed;
    Trace trace;
    std::size_t restarts = 0;
    nc::ProgramStream::Hooks hooks;
    hooks.look = [&](const nc::Program& p) {
      if (p.first_block == 0) printed.clear();
      printed += nc::print(p);
    };
    hooks.restart = [&] {
      trace = {};
      ++restarts;
    };
    nc::ProgramStream stream(text, "t.nc", dialect, hooks, window, kept);
    const auto result = nc::interpret(stream, settings, trace);
    const Reading found = reading(stream.program(), stream.diagnostics(), result, trace);
    if (!(found == whole)) {
      INFO(text.substr(0, 3000));
      INFO("window " << window << ", kept " << kept);
      CHECK(found.text == whole.text);
      REQUIRE(found.calls == whole.calls);
      REQUIRE(found.hash == whole.hash);
      REQUIRE(found == whole);
    }
    if (printed != text) REQUIRE(printed == text);
    if (restarts > 1) REQUIRE(restarts <= 1);
    if (window == 1 && kept == 0) {
      seen.ok += result.ok() ? 1 : 0;
      seen.windowed += stream.jumps() ? 0 : 1;
      seen.jumping += stream.jumps() ? 1 : 0;
      seen.faulty += has_error(stream.diagnostics()) ? 1 : 0;
      seen.restarted += restarts;
    }
  }
}

void report(const char* what, const Seen& seen) {
  WARN(what << ": " << seen.texts << " texts, " << seen.calls << " calls the same; " << seen.ok
            << " read without fault, " << seen.windowed << " in windows, " << seen.jumping
            << " that jump, of these " << seen.restarted << " begun again, " << seen.faulty
            << " with faulty text");
}

nc::InterpreterSettings lenient() {
  nc::InterpreterSettings settings = mill_settings();
  settings.process.unmapped = UnmappedWords::comment;
  settings.run_budget = 20'000;
  settings.tool_diameters = {{1, 3.0}, {2, 4.0}};
  return settings;
}

struct File {
  std::filesystem::path path;
  std::string text;
};

std::vector<File> files() {
  std::vector<File> out;
  for (const char* folder : {"1_five_axis", "3_three_axis", "7_linuxcnc_interp"})
    for (auto& path : corpus_files(
             folder, {".ngc", ".nc", ".mpf", ".txt", ".eia", ".tap", ".gcode", ".cnc", ".spf"}))
      out.push_back({path, read_bytes(path)});
  return out;
}

std::string mutated(std::string text, std::mt19937& random) {
  static const std::string kSigns = "GXYZABCIJKRPQFSTMNOEe0123456789.+-()[]#/%;=\"<> \t\n\r";
  const int changes = 1 + static_cast<int>(random() % 4);
  for (int c = 0; c < changes && !text.empty(); ++c) {
    const std::size_t at = random() % text.size();
    const char byte =
        random() % 2 == 0 ? static_cast<char>(random() & 0xff) : kSigns[random() % kSigns.size()];
    if (random() % 3 == 0) {
      text.insert(text.begin() + static_cast<std::ptrdiff_t>(at), byte);
    } else {
      text[at] = byte;
    }
  }
  return text;
}

/// Five-axis blocks as a CAM post writes them, `between` behind every thousandth.
std::string five_axis(int lines, const std::string& between = "") {
  std::mt19937 random(1);
  std::string out = "%\nG21 G90 G94\nG0 X0 Y0 Z0 A0 C0\n";
  char line[120];
  const auto number = [&] { return static_cast<double>(random() % 8'000'000) * 1e-4 - 400.0; };
  for (int i = 0; i < lines; ++i) {
    const double v[] = {number(), number(), number(), number(), number()};
    std::snprintf(line, sizeof line, "G1 X%.4f Y%.4f Z%.4f A%.4f C%.4f F%d\n", v[0], v[1], v[2],
                  0.4 * v[3], 0.4 * v[4], 500 + static_cast<int>(random() % 4000));
    out += line;
    if (i % 1000 == 0) out += between;
  }
  return out + "M2\n";
}

/// Bytes that are allocated now.
std::size_t allocated() {
  const auto info = mallinfo2();
  return info.uordblks + info.hblkhd;
}

struct Peak final : QuietSink {
  std::size_t most = 0, motions = 0;
  void sample() { most = std::max(most, allocated()); }
  void motion(const CanonicalMotion&) override {
    if (++motions % 500 == 0) sample();
  }
};

}  // namespace

TEST_CASE("stream: a program in windows is the program, with its faults", "[formats][nc][stream]") {
  const char* programs[] = {
      "",
      "\n",
      "M2",
      "%\nG0 X1\n%\ntrailer X1 (\n",
      "G0 X1\nM2\nX2 junk\n(\nG1 X[\n",
      "\xEF\xBB\xBFG0 X1\r\nX2\rX3\nM30\n",
      "G0 X1 )\nX2\nX3 X4\n$\nM2\n",
      "G0 X1\n/M2\nX2\nM2\nX3",
      "X1\n#1=3\nG0 X#1\nG[#1-2] X9 F9\nM2\nX5\n",
      "G0 X1\nX2\nX3\nX4\nX5\nX6\nX7\nX8\nX9\nM98 P5\nM2\nO5\nX11\nM99\n",
      "G0 X1\nX2\nX3\nX4\nX5\nX6\nX7\nX8\nX9\no1 while [#1 lt 3]\n#1=[#1+1]\nX#1\no1 "
      "endwhile\nM2\n",
      "o1 sub\nG0 X#1\no1 endsub\nX1 (\nG0 X2\nX3\nX4\nX5\nX6\nX7\nX8\no1 call [3]\nM2\n",
      "G0 X1\nX2\nX3\nX4\nX5\nX6\nX7\nX8\nX9\no1 endwhile\n(\nM2\no2 if [1]\n",
      "N10 G0 X1.\nN20 X2.\nG65 P7 X3.\nM30\nO7\nX#24\nM99\n",
      "N10 G0 X1.\nN20 X2.\nX3.\nX4.\nX5.\nX6.\nX7.\nX8.\nGOTO 20\nM30\n",
      "N10 G0 X1\nTRAORI\nG1 X2 F5\nMSG(\"a\")\nX3\nX4\nX5\nX6\nX7\nGOTOF ENDE\nX8\nENDE:\nM30\n",
      "%_N_A_MPF\nG0 X1\nM30\n%_N_B_SPF\nX2\nM17\n",
      "%_N_A_MPF\nDEF REAL AA=1\nN10 G0 X=AA\nAA=AA+1\nIF AA<4 GOTOB N10\nL200\nL200\nX=AA\nM30\n"
      "%_N_L200_SPF\nDEF REAL BB\nBB=5\nG1 X=BB F5\nM17\n",
      "%_N_A_MPF\nDEF REAL AA=1\nL200\nX=BB\nM30\n%_N_L200_SPF\nDEF REAL BB\nBB=5\nX=AA\nM17\n",
      "PROC A(REAL AA)\nG0 X=AA\nB(3)\nB(4)\nM30\nPROC B(REAL BB)\nG0 X=BB\nM17\n",
      "G0 X1\nG1\nG5.2 X1 Y1 P1\nX2 Y3 P1\nX3 Y1 P1\nX4 Y0 P1\n",
      "G0 X0 Y0\nG81 X1 Y1 Z-1 R2 F9 L30000\nX2\nM2\n"};
  Seen seen;
  for (const char* program : programs) {
    std::string many = "G0 X1 Y1 Z1\n";
    for (int i = 0; i < 30; ++i)
      many += "X" + std::to_string(i) + " (" + std::string(99, 'c') + ")\n";
    for (const auto dialect : kDialects) {
      require_same(program, lenient(), dialect, seen);
      require_same(many + program, lenient(), dialect, seen);
      nc::InterpreterSettings plain = lenient();
      plain.plain_blocks = true;
      plain.execute_deleted = false;
      require_same(many + program, plain, dialect, seen);
    }
  }
  report("chosen programs", seen);
  CHECK(seen.windowed > 50);
  CHECK(seen.ok > 20);
}

TEST_CASE("stream: more than a hundred faults, those of the flow first", "[formats][nc][stream]") {
  std::string text;
  for (int i = 0; i < 150; ++i) text += "G0 X1 X2\nG99 G98 ( \n";
  Seen seen;
  require_same(text, lenient(), nc::InputDialect::linuxcnc, seen);
  require_same(text + "o1 endwhile\nM2\n", lenient(), nc::InputDialect::linuxcnc, seen);
  require_same("M2\n" + text + "o1 endwhile\nM2\n", lenient(), nc::InputDialect::linuxcnc, seen);
}

TEST_CASE("stream: every NC file of the corpus in four dialects", "[formats][nc][stream][corpus]") {
  Seen seen;
  for (const File& file : files()) {
    if (file.text.size() > 300'000) continue;
    INFO(file.path.string());
    nc::InterpreterSettings settings = lenient();
    settings.subroutine_folders = {file.path.parent_path().string()};
    for (const auto dialect : kDialects) require_same(file.text, settings, dialect, seen);
  }
  if (seen.texts == 0) {
    WARN("no corpus beside the checkout: skipped");
    return;
  }
  report("corpus", seen);
  CHECK(seen.windowed > 100);
}

TEST_CASE("stream: the corpus' large files", "[formats][nc][stream][corpus][slow]") {
  Seen seen;
  for (const File& file : files())
    if (file.text.size() > 300'000)
      require_same(file.text, lenient(), nc::InputDialect::linuxcnc, seen);
  report("large files", seen);
}

TEST_CASE("stream: 4,000 damaged programs", "[formats][nc][stream][corpus]") {
  std::vector<std::string> pool;
  for (File& file : files())
    if (!file.text.empty() && file.text.size() <= 6'000) pool.push_back(std::move(file.text));
  if (pool.empty()) {
    WARN("no corpus beside the checkout: skipped");
    return;
  }
  std::mt19937 random(7);
  Seen seen;
  for (std::size_t i = 0; i < 4'000; ++i)
    require_same(mutated(pool[random() % pool.size()], random), lenient(), kDialects[i % 4], seen);
  report("damaged programs", seen);
  CHECK(seen.texts == 4'000);
  CHECK(seen.windowed > 1'000);
  CHECK(seen.faulty > 1'000);
}

TEST_CASE("stream: words, flow and faults in random order", "[formats][nc][stream]") {
  static const char* kWords[] = {"G0",
                                 "G1",
                                 "G2",
                                 "G5.2",
                                 "G5.3",
                                 "G7",
                                 "G40",
                                 "G41.1 D2",
                                 "G43 H1",
                                 "G65 P5",
                                 "G81 R3",
                                 "G90",
                                 "G91",
                                 "M0",
                                 "M2",
                                 "M3 S100",
                                 "M6 T1",
                                 "M30",
                                 "M98 P5",
                                 "M99",
                                 "M70",
                                 "M72",
                                 "X1",
                                 "Y-2.5",
                                 "Z3.",
                                 "A10.",
                                 "I1",
                                 "R5",
                                 "P1",
                                 "F100",
                                 "#1=3",
                                 "X#1",
                                 "G[1]",
                                 "M[2]",
                                 "(c)",
                                 "(MSG, m)",
                                 "/",
                                 "%",
                                 "(",
                                 "X",
                                 "$",
                                 "\nO5\n",
                                 "\no1 if [#1 gt 2]\n",
                                 "\no1 endif\n",
                                 "\no2 sub\n",
                                 "\no2 endsub\n",
                                 "\no2 call\n",
                                 "\nN20",
                                 "\nGOTO 20\n",
                                 "\nIF [#1 EQ 3] GOTO 20\n",
                                 "\nWHILE [#1 LT 3] DO 1\n",
                                 "\nEND 1\n",
                                 "TRAORI",
                                 "G54",
                                 "\nGOTOF AA\n",
                                 "\nAA:",
                                 "\nL100\n",
                                 "\nPROC L100\n",
                                 "M17",
                                 "R1=R1+1"};
  std::mt19937 random(11);
  Seen seen;
  for (std::size_t i = 0; i < 4'000; ++i) {
    std::string text;
    const std::size_t kinds = i % 3 == 0 ? std::size(kWords) : 41;  // without flow, in windows
    for (int line = 0; line < 25; ++line) {
      const int n = 1 + static_cast<int>(random() % 3);
      for (int w = 0; w < n; ++w) text += std::string(kWords[random() % kinds]) + " ";
      text += random() % 20 == 0 ? "\r" : "\n";
    }
    require_same(text, lenient(), kDialects[i % 4], seen);
  }
  report("random words", seen);
  CHECK(seen.windowed > 300);
}

TEST_CASE("stream: a window is the part of the program that its numbers say",
          "[formats][nc][stream]") {
  const std::string text = five_axis(50);
  const nc::Program whole = nc::parse(text, "t.nc").program;
  CHECK(whole.is_whole());
  nc::ProgramStream stream(text, "t.nc", nc::InputDialect::linuxcnc, {}, 8);
  const nc::Program& window = stream.program();
  CHECK(window.first_block == 0);
  CHECK(window.block_count == whole.block_count);
  std::size_t blocks = 0;
  do {
    REQUIRE(window.first_block == blocks);
    REQUIRE(window.blocks.size() <= 8);
    for (std::size_t i = blocks; window.holds(i); ++i, ++blocks) {
      const nc::Block& a = window.block(i);
      const nc::Block& b = whole.block(i);
      REQUIRE(a.piece_count == b.piece_count);
      for (std::uint32_t k = 0; k < a.piece_count; ++k) {
        const nc::Piece& p = window.pieces[a.first_piece + k];
        const nc::Piece& q = whole.pieces[b.first_piece + k];
        REQUIRE(p.begin == q.begin);
        REQUIRE(p.length == q.length);
        REQUIRE(p.value == q.value);
      }
    }
  } while (stream.next());
  CHECK(blocks == whole.block_count);
  CHECK_FALSE(stream.next());
  CHECK_FALSE(stream.begins_again());
  // A second run of it, and its diagnostics before its end, are faults of the caller.
  Trace trace;
  CHECK_THROWS_AS(nc::interpret(stream, {}, trace), ContractViolation);
  const nc::ProgramStream begun(text, "t.nc", nc::InputDialect::linuxcnc, {}, 8);
  CHECK_THROWS_AS(begun.diagnostics(), ContractViolation);
}

TEST_CASE("stream: reading 100,000 five-axis lines takes less than twice the text",
          "[formats][nc][stream]") {
  const auto probed = allocated();
  const auto probe = std::make_unique<std::vector<char>>(std::size_t{1} << 20);
  if (allocated() < probed + probe->size()) {
    WARN("this build's allocator does not say what is allocated: skipped");
    return;
  }
  // Peak memory of reading, text included, in texts.
  const nc::InterpreterSettings settings;
  const auto in_windows = [&](const std::string& text) {
    const std::size_t before = allocated();
    Peak peak;
    nc::ProgramStream::Hooks hooks;
    hooks.look = [&](const nc::Program&) { peak.sample(); };
    nc::ProgramStream stream(text, "t.nc", nc::InputDialect::linuxcnc, hooks);
    REQUIRE(nc::interpret(stream, settings, peak).ok());
    REQUIRE(peak.motions >= 100'001);
    return static_cast<double>(peak.most - before) / static_cast<double>(text.size());
  };
  const auto as_a_whole = [&](const std::string& text) {
    const std::size_t before = allocated();
    Peak peak;
    const nc::ParsedProgram parsed = nc::parse(text, "t.nc");
    peak.sample();
    REQUIRE(nc::interpret(parsed.program, settings, peak).ok());
    return static_cast<double>(peak.most - before) / static_cast<double>(text.size());
  };
  const std::string plain = five_axis(100'000);
  // Every thousandth line calls what stands behind the end.
  const std::string calls = five_axis(300'000, "o1 call [5]\n") + "o1 sub\nG0 Z#1\no1 endsub\n";
  const double windowed = in_windows(plain), jumping = in_windows(calls), whole = as_a_whole(plain);
  WARN("peak memory of reading, text included: "
       << windowed << " times the text of " << plain.size() << " bytes, with calls " << jumping
       << " times; parsed as a whole " << whole << " times");
  CHECK(windowed < 2.0);
  CHECK(jumping < 3.0);
  CHECK(whole > 3.0);  // the count sees pieces
}

}  // namespace smoothpost::test
