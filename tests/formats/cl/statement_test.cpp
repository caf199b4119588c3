#include "formats/cl/statement.h"

#include <catch2/catch.hpp>

namespace smoothpost::test {
namespace {

using cl::Item;
using cl::Scanner;
using cl::Statement;

/// Every statement of a text in short: major, then items.
std::vector<std::string> scanned(const std::string& text) {
  cl::DiagnosticLog log("t.apt");
  Scanner scanner(text, &log);
  std::vector<std::string> out;
  while (scanner.next()) {
    const Statement& s = scanner.statement();
    if (s.kind == Statement::Kind::comment) {
      out.push_back("$$" + std::string(s.text));
      continue;
    }
    std::string line = s.kind == Statement::Kind::bad ? "!" : std::string(s.major);
    for (const Item& item : s.items) {
      const bool empty = item.kind == Item::Kind::empty;
      line += " " + (empty ? std::string("-") : std::string(item.text));
    }
    if (!s.text.empty()) line += " [" + std::string(s.text) + "]";
    if (!s.trailing.empty()) line += " $$" + std::string(s.trailing);
    out.push_back(line);
  }
  return out;
}

using Lines = std::vector<std::string>;

}  // namespace

TEST_CASE("statement: words values and blanks", "[formats][cl]") {
  CHECK(scanned("GOTO/1,2,3") == Lines{"GOTO 1 2 3"});
  CHECK(scanned("  goto  /   -3.5 ,\t+.25,1.5E-3 \n") == Lines{"goto -3.5 +.25 1.5E-3"});
  CHECK(scanned("RAPID\nRAPID/\n") == Lines{"RAPID", "RAPID"});
  CHECK(scanned("FEDRAT/MMPM,5") == Lines{"FEDRAT MMPM 5"});
  CHECK(scanned("GOTO/1,,3\nGOTO/1,2,\n") == Lines{"GOTO 1 - 3", "GOTO 1 2 -"});
  CHECK(scanned("END-OF-PATH") == Lines{"END-OF-PATH"});
  CHECK(scanned("TOOL PATH/POCKET (A),TOOL,T 1") == Lines{"TOOL PATH [POCKET (A),TOOL,T 1]"});
  CHECK(scanned("TLON,GOFWD/(CIRCLE/1,2,3,4),ON,(LINE/1,2)") ==
        Lines{"TLON GOFWD / ( CIRCLE / 1 2 3 4 ) ON ( LINE / 1 2 )"});
  CHECK(scanned("1.0, 2.0\n-3,4") == Lines{" 1.0 2.0", " -3 4"});
}

TEST_CASE("statement: line ends byte order mark and the last line", "[formats][cl]") {
  const Lines expected{"GOTO 1 2 3", "RAPID"};
  CHECK(scanned("GOTO/1,2,3\nRAPID\n") == expected);
  CHECK(scanned("GOTO/1,2,3\r\nRAPID") == expected);
  CHECK(scanned("GOTO/1,2,3\rRAPID\r") == expected);
  CHECK(scanned("\xef\xbb\xbfGOTO/1,2,3\n\n\n  \nRAPID") == expected);
  CHECK(scanned("").empty());
  CHECK(scanned("\n \r\n").empty());
}

TEST_CASE("statement: continuation", "[formats][cl]") {
  CHECK(scanned("GOTO/1,$\n 2,$ \r\n3\nRAPID") == Lines{"GOTO 1 2 3", "RAPID"});
  CHECK(scanned("GOTO/1,2$\n,3") == Lines{"GOTO 1 2 3"});
  CHECK(scanned("GOTO/1,2,3,$") == Lines{"!"});
  CHECK(scanned("GOTO/1,$2,3\nRAPID") == Lines{"!", "RAPID"});
  // Text that goes on is one statement; PPRINT ends with its line.
  CHECK(scanned("TLDATA/MILL,1,$\n2\nRAPID") == Lines{"TLDATA", "RAPID"});
  CHECK(scanned("PPRINT costs 5 $\nRAPID") == Lines{"PPRINT [costs 5 $]", "RAPID"});
}

TEST_CASE("statement: comments and texts", "[formats][cl]") {
  CHECK(scanned("$$ a, b\n  $$c\nGOTO/1,2,3 $$ here\n") ==
        Lines{"$$a, b", "$$c", "GOTO 1 2 3 $$here"});
  CHECK(scanned("PPRINT/TEXT\nPARTNO  P 1\nREMARK\nINSERT/M 8\nPPRINTTEXT\n") ==
        Lines{"PPRINT [TEXT]", "PARTNO [P 1]", "REMARK", "INSERT [M 8]", "PPRINT [TEXT]"});
  CHECK(scanned("$$-> CSYS / 1, 0,$\n 5\n$$-> END /\n$$-> CSYS of part\n") ==
        Lines{"CSYS 1 0 5", "$$-> END /", "$$-> CSYS of part"});
}

TEST_CASE("statement: written() is the statement in one line", "[formats][cl]") {
  const std::string text = "CUTTER/ 1.0,$\r\n  2.0 $$ c\nINSERT/a $$ b\nQQ / 1,$\n2";
  Scanner scanner(text, nullptr);
  REQUIRE(scanner.next());
  CHECK(scanner.written() == "CUTTER/ 1.0,2.0");
  REQUIRE(scanner.next());
  CHECK(scanner.written() == "INSERT/a $$ b");
  REQUIRE(scanner.next());
  CHECK(scanner.written() == "QQ / 1,2");
  CHECK(scanner.statement().word() == cl::Word::unknown);
  CHECK_FALSE(scanner.next());
}

TEST_CASE("statement: places", "[formats][cl]") {
  const std::string text = "\n  GOTO / 1,$\r\n   25,3\n";
  Scanner scanner(text, nullptr);
  REQUIRE(scanner.next());
  const Statement& s = scanner.statement();
  CHECK(s.place.line == 2);
  CHECK(s.place.column == 3);
  REQUIRE(s.items.size() == 3);
  CHECK(s.items[0].place.column == 10);
  CHECK(s.items[1].place.line == 3);
  CHECK(s.items[1].place.column == 4);
  CHECK(s.items[1].value == 25.0);
}

TEST_CASE("statement: memory is bounded by the longest statement allowed", "[formats][cl]") {
  std::string text = "GOTO/1";
  for (std::size_t i = 0; i < 5 * Scanner::kMostItems; ++i) text += ",$\n1";
  text += "\nRAPID\n";
  cl::DiagnosticLog log("t.apt");
  Scanner scanner(text, &log);
  REQUIRE(scanner.next());
  CHECK(scanner.statement().kind == Statement::Kind::bad);
  CHECK(scanner.statement().items.size() <= Scanner::kMostItems + 1);
  REQUIRE(scanner.next());
  CHECK(scanner.statement().word() == cl::Word::rapid);
  const Diagnostics told = log.take();
  REQUIRE(told.size() == 1);
  CHECK(told.front().code == "CL105");
}

}  // namespace smoothpost::test
