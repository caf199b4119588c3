#include "formats/nc/parser.h"

#include <catch2/catch.hpp>
#include <charconv>
#include <cmath>
#include <random>
#include <string>

#include "formats/nc/number.h"
#include "tests/formats/nc/recording.h"

namespace smoothpost::nc {
namespace {

std::vector<std::string> codes(const ParsedProgram& parsed) {
  std::vector<std::string> out;
  for (const Diagnostic& d : parsed.diagnostics) out.push_back(d.code);
  return out;
}

/// The words of a program as "G1 X1.5", in order.
std::string words(const ParsedProgram& parsed) {
  std::string out;
  for (const Piece& piece : parsed.program.pieces) {
    if (piece.kind != PieceKind::word) continue;
    char buffer[64];
    std::snprintf(buffer, sizeof buffer, "%s%c%.10g", out.empty() ? "" : " ", piece.letter,
                  piece.value);
    out += buffer;
  }
  return out;
}

/// Every byte in exactly one piece, pieces in order, blocks tile the pieces, one block a line.
void require_tiling(const Program& program) {
  std::uint32_t byte = 0;
  for (const Piece& piece : program.pieces) {
    REQUIRE(piece.begin == byte);
    REQUIRE(piece.length > 0);
    byte += piece.length;
  }
  REQUIRE(byte == program.text.size());
  std::uint32_t piece = 0;
  for (const Block& block : program.blocks) {
    REQUIRE(block.first_piece == piece);
    REQUIRE(block.piece_count > 0);
    for (std::uint32_t i = 0; i < block.piece_count; ++i) {
      const bool last = i + 1 == block.piece_count;
      const bool is_end = program.pieces[piece + i].kind == PieceKind::line_end;
      REQUIRE((!is_end || last));
      if (last && !is_end) REQUIRE(&block == &program.blocks.back());
    }
    piece += block.piece_count;
  }
  REQUIRE(piece == program.pieces.size());
}

void require_identity(const std::string& text) {
  const ParsedProgram parsed = parse(text, "t.ngc");
  REQUIRE(print(parsed.program) == text);
  require_tiling(parsed.program);
}

}  // namespace

TEST_CASE("number: nearest double", "[formats][nc][lexer]") {
  std::mt19937_64 random(7);
  std::size_t tested = 0;
  for (int i = 0; i < 200'000; ++i) {
    std::string text;
    if (random() % 3 == 0) text = "-";
    const int whole = static_cast<int>(random() % 12);
    const int decimals = static_cast<int>(random() % 16);
    for (int d = 0; d < whole; ++d) text.push_back(static_cast<char>('0' + random() % 10));
    if (decimals > 0 || whole == 0) text.push_back('.');
    for (int d = 0; d < decimals || (whole == 0 && d < 1); ++d) {
      text.push_back(static_cast<char>('0' + random() % 10));
    }
    double expected = 0.0;
    std::from_chars(text.data(), text.data() + text.size(), expected);
    const ScannedNumber got = scan_number(text.data(), text.data() + text.size());
    REQUIRE(got.ok);
    REQUIRE(got.next == text.data() + text.size());
    REQUIRE(got.value == expected);
    REQUIRE_FALSE((got.value == 0.0 && std::signbit(got.value)));
    ++tested;
  }
  CHECK(tested == 200'000);
}

TEST_CASE("number: forms that the language allows and refuses", "[formats][nc][lexer]") {
  const auto value = [](const std::string& text) {
    const ScannedNumber got = scan_number(text.data(), text.data() + text.size());
    return got.ok ? got.value : std::nan("");
  };
  CHECK(value(".5") == 0.5);
  CHECK(value("+0.5") == 0.5);
  CHECK(value("-.0000001") == -1e-7);
  CHECK(value("0.12345678") == 0.12345678);
  CHECK(value("1 . 5") == 1.5);
  CHECK(value("- 1 0") == -10.0);
  CHECK(value("5.") == 5.0);
  CHECK(value("123456789012345678901234567890.5") == 123456789012345678901234567890.5);
  CHECK(value("0." + std::string(60, '0') + "1") == 1e-61);
  for (const char* bad : {"", ".", "-", "+", "-.", "--1", "x"}) CHECK(std::isnan(value(bad)));
  CHECK(std::isnan(value(std::string(400, '9'))));
}

TEST_CASE("parser: the lexical rules of RS274NGC", "[formats][nc][parser]") {
  CHECK(words(parse("n10 g 0 x 1 . 5\n", "t")) == "N10 G0 X1.5");
  CHECK(words(parse("G0X.5Y+0.5Z-.25", "t")) == "G0 X0.5 Y0.5 Z-0.25");
  CHECK(words(parse("X1e-3", "t")) == "X1 E-3");  // no exponents: E is a word
  CHECK(words(parse("g1\tx1\ty2", "t")) == "G1 X1 Y2");
  CHECK(words(parse("O1234 (NAME)\nG0X1\n", "t")) == "O1234 G0 X1");
  CHECK(words(parse("N10 O1234\n", "t")) == "N10 O1234");
  CHECK(words(parse("N1.5 G0 X1 ; G1 X2\n(G1 X3)\n", "t")) == "N1.5 G0 X1");
  CHECK(parse("G1 X1 (gr\xc3\xbc\xc3\x9f) ; \xe2\x82\xac\n", "t").diagnostics.empty());
  CHECK(parse("\xEF\xBB\xBFG0 X1\n", "t").diagnostics.empty());
  CHECK(parse("G1 X1 (" + std::string(5000, 'a') + ")\n", "t").diagnostics.empty());
}

TEST_CASE("parser: line ends LF, CR LF and CR", "[formats][nc][parser]") {
  for (const char* text : {"G0 X1\nX2\n", "G0 X1\r\nX2\r\n", "G0 X1\rX2\r", "G0 X1\nX2"}) {
    const ParsedProgram parsed = parse(text, "t");
    CHECK(parsed.program.blocks.size() == 2);
    CHECK(words(parsed) == "G0 X1 X2");
    CHECK(parsed.diagnostics.empty());
    require_identity(text);
  }
  CHECK(parse("\n\r\n\r", "t").program.blocks.size() == 3);
  CHECK(parse("", "t").program.blocks.empty());
}

TEST_CASE("parser: percent and trailer", "[formats][nc][parser]") {
  const std::string text = " % \nG0 X1\n%\nanything [#<> goes\nhere\n";
  const ParsedProgram parsed = parse(text, "t");
  CHECK(parsed.diagnostics.empty());
  CHECK(words(parsed) == "G0 X1");
  CHECK(parsed.program.blocks.size() == 5);
  CHECK(parsed.program.pieces[parsed.program.blocks[3].first_piece].kind == PieceKind::trailer);
  require_identity(text);
  CHECK(codes(parse("%abc\nG0 X1\n", "t")) == std::vector<std::string>{"NC107"});
  CHECK(codes(parse("G0 X1 %\n", "t")) == std::vector<std::string>{"NC107"});
  CHECK(codes(parse("G0 X1\n%\n", "t")) == std::vector<std::string>{"NC112"});
  CHECK(codes(parse("G0 X1\nM30\n%\n", "t")).empty());
}

TEST_CASE("parser: what follows M2 or M30 is not judged", "[formats][nc][parser]") {
  CHECK(parse("G0 X1\nM2\n garbage $$$ [\n", "t").diagnostics.empty());
  CHECK(parse("G0 X1\nm 3 0\n garbage $$$ [\n", "t").diagnostics.empty());
  CHECK_FALSE(parse("G0 X1\nM20\n garbage $$$ [\n", "t").diagnostics.empty());
  CHECK_FALSE(parse("G0 X1\n/M2\n garbage $$$ [\n", "t").diagnostics.empty());
  CHECK_FALSE(parse("G0 X1\n(M2)\n garbage $$$ [\n", "t").diagnostics.empty());
}

TEST_CASE("parser: each foreign construct is named where it stands", "[formats][nc][parser]") {
  struct Row {
    const char* text;
    const char* code;
    int column;
    const char* shown;
  };
  const Row rows[] = {
      {"G1 X[1+2", "NC130", 5, "not closed"},
      {"G1 X#<a Y3", "NC130", 6, "no >"},
      {"#1 X5", "NC130", 4, "= and a value"},
      {"G1 [3]", "NC120", 4, "[3]"},
      {"o100 subs", "NC150", 6, "subs"},
      {"O<helix> call [1] 2 (c)", "NC150", 19, "nothing else"},
      {"G1 X1 O5", "NC122", 7, "O5"},
      {"MSG(\"x\")", "NC125", 1, "MSG"},
      {"\"text\"", "NC123", 1, "text"},
      {"R1=5", "NC124", 1, "R1=5"},
      {"A3=0.5 B3=1", "NC124", 1, "A3=0.5"},
      {"N30 DEF REAL x", "NC125", 5, "DEF REAL x"},
      {"N40 TRAORI", "NC128", 5, "TRAORI"},
      {"G1 @3 ^45", "NC126", 4, "@3"},
      {"M3 $0", "NC127", 4, "$0"},
      {"(a (b) c)", "NC103", 1, "(a (b)"},
      {"(abc", "NC102", 1, "(abc"},
      {"G0 X1)", "NC109", 6, ")"},
      {"G0 / X1", "NC108", 4, "/"},
      {"G0 X1.2.3", "NC105", 4, "X1.2.3"},
      {"G0 X--1", "NC105", 4, "X--1"},
      {"G0 X1,5", "NC105", 4, "X1,5"},
      {"G0 X.", "NC105", 4, "X."},
      {"G0 X", "NC104", 4, "X"},
      {"G0 X Y1", "NC104", 4, "X"},
      {"G0 5", "NC105", 0, ""},
      {"G0 X1 N5", "NC110", 7, "N5"},
      {":5", "NC101", 1, ":"},
      {"G0 X1 *55", "NC101", 7, "*"},
      {"\x01\x02", "NC101", 1, "\\x01\\x02"},
  };
  for (const Row& row : rows) {
    const ParsedProgram parsed = parse(std::string(row.text) + "\n", "part.nc");
    INFO(row.text);
    if (row.column == 0) {
      // "0 5" is one number with a blank inside.
      CHECK(words(parsed) == "G5");
      continue;
    }
    REQUIRE_FALSE(parsed.diagnostics.empty());
    const Diagnostic& d = parsed.diagnostics.front();
    INFO(to_string(d));
    CHECK(d.code == row.code);
    CHECK(d.severity == Severity::error);
    CHECK(d.where.line == 1);
    CHECK(d.where.column == row.column);
    CHECK(d.where.file == "part.nc");
    CHECK(d.text.find(row.shown) != std::string::npos);
    require_identity(std::string(row.text) + "\n");
  }
}

TEST_CASE("parser: a number alone is refused", "[formats][nc][parser]") {
  CHECK(codes(parse("(c) 5\n", "t")) == std::vector<std::string>{"NC106"});
  CHECK(codes(parse("-1.5\n", "t")) == std::vector<std::string>{"NC106"});
}

TEST_CASE("parser: errors are capped and counted", "[formats][nc][parser]") {
  std::string text;
  for (int i = 0; i < 1000; ++i) text += "X[1\n";
  const ParsedProgram parsed = parse(text, "t");
  REQUIRE(parsed.diagnostics.size() == 101);
  CHECK(parsed.diagnostics.back().severity == Severity::note);
  CHECK(parsed.diagnostics.back().text.find("1000") != std::string::npos);
}

TEST_CASE("parser: print(parse(text)) == text for random bytes", "[formats][nc][parser]") {
  std::mt19937 random(11);
  std::size_t bytes = 0;
  for (int i = 0; i < 2'000; ++i) {
    std::string text(random() % 400, ' ');
    for (char& c : text) c = static_cast<char>(random() & 0xff);
    require_identity(text);
    bytes += text.size();
  }
  // Characters of the language in random order reach more of the rules.
  static const std::string kSigns = "GXYNOMFe0123456789.+-()[]#/%;=\"<>@^$ \t\n\r*_,ab";
  for (int i = 0; i < 20'000; ++i) {
    std::string text(random() % 80, ' ');
    for (char& c : text) c = kSigns[random() % kSigns.size()];
    require_identity(text);
    bytes += text.size();
  }
  WARN("random texts: 22000 with " << bytes << " bytes");
}

TEST_CASE("parser: time is linear in texts made to be slow", "[formats][nc][parser]") {
  const std::size_t n = 2'000'000;
  for (const std::string& part :
       {std::string("\r"),   std::string("/ "),   std::string("( "),     std::string("[ "),
        std::string("X "),   std::string("% "),   std::string("#"),      std::string("\""),
        std::string("O "),   std::string("1 "),   std::string("X1 "),    std::string(" "),
        std::string("("),    std::string("\xff"), std::string("X="),     std::string("R1=R1 "),
        std::string("A("),   std::string("X[1+"), std::string("X#"),     std::string("-"),
        std::string("X=1 "), std::string("A[ "),  std::string("TRAORI ")}) {
    std::string text;
    while (text.size() < n) text += part;
    // Quadratic work would take minutes.
    CHECK(print(parse(text, "t").program) == text);
    CHECK(print(parse(text, "t", InputDialect::siemens).program) == text);
  }
  // Blanks before many signs that ask what stands before them.
  const std::string text = std::string(n / 2, ' ') + std::string(n / 2, '/');
  CHECK(print(parse(text, "t").program) == text);
}

TEST_CASE("program: a piece has 24 bytes", "[formats][nc][parser]") { CHECK(sizeof(Piece) == 24); }

}  // namespace smoothpost::nc
