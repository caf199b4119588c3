#include "formats/nc/dialect_detection.h"

#include <catch2/catch.hpp>
#include <string>

namespace smoothpost::nc {

TEST_CASE("dialect detection: unambiguous marks", "[formats][nc][dialects]") {
  const auto only = [](const char* text) {
    const auto found = fitting_dialects(text);
    return found.size() == 1 ? static_cast<int>(found[0]) : -1 - static_cast<int>(found.size());
  };
  const int linuxcnc = static_cast<int>(InputDialect::linuxcnc);
  const int fanuc = static_cast<int>(InputDialect::fanuc);
  const int haas = static_cast<int>(InputDialect::haas);
  const int siemens = static_cast<int>(InputDialect::siemens);
  CHECK(only("G0 X1\nM428\nM2") == linuxcnc);
  CHECK(only("o<a> call [1]") == linuxcnc);
  CHECK(only("O100 sub") == linuxcnc);
  CHECK(only("#<depth>=1") == linuxcnc);
  CHECK(only("(MSG, hello)") == linuxcnc);
  CHECK(only("N10 g43.4 H1") == fanuc);
  CHECK(only("G0X1G43.5H1") == fanuc);
  CHECK(only("G05.1 Q1") == fanuc);
  CHECK(only("G234 H1\nG43.4") == haas);
  CHECK(only("N40 TRAORI") == siemens);
  CHECK(only("X1 A3=0.5 B3=0 C3=1") == siemens);
  CHECK(only("N5 MSG(\"x\")") == siemens);
  CHECK(only("R1=5") == siemens);
  CHECK(only("%_N_PART_MPF\n") == siemens);
  CHECK(only("G0 X1 Y2\nM30\n") == -1);
  CHECK(only("O1000 (G43.4)\nG0 X1 ; TRAORI\n") == -1);
  CHECK(only("M4280\nG43.45\nG2345\n") == -1);
  CHECK(only("M428\nTRAORI\n") == -3);
}

TEST_CASE("dialect detection: Heidenhain is known and not read", "[formats][nc][dialects]") {
  CHECK(is_heidenhain("0 BEGIN PGM PART MM\r\n1 L X+1\r\n"));
  CHECK_FALSE(is_heidenhain("G0 X1\n"));
}

}  // namespace smoothpost::nc
