#include "formats/toml/toml.h"

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <random>

#include "tests/support/support.h"

using namespace smoothpost;

namespace {

TomlTable parse(const std::string& text) {
  const auto result = parse_toml(text, "t.toml");
  REQUIRE(result.ok());
  CHECK(result.diagnostics().empty());
  return result.value();
}

Diagnostic failure(const std::string& text) {
  const auto result = parse_toml(text, "t.toml");
  REQUIRE_FALSE(result.ok());
  REQUIRE(result.diagnostics().size() == 1);
  CHECK(result.diagnostics()[0].where.file == "t.toml");
  return result.diagnostics()[0];
}

std::string repeat(const std::string& text, int count) {
  std::string out;
  for (int i = 0; i < count; ++i) out += text;
  return out;
}

void check_place(const SourceLocation& where, int line, int column) {
  CHECK(where.line == line);
  CHECK(where.column == column);
}

}  // namespace

TEST_CASE("toml: kinds and values", "[formats][toml]") {
  const TomlTable table = parse(
      "i = -42\nr = 2.5\nhex = 0x1F\ns = \"a\\tb\"\nlit = 'c\\d'\nb = true\n"
      "d = 2026-11-24\na = [1, 2.0, \"x\"]\nt = { k = 1 }\nn = nan\nf = -inf\n");
  CHECK(table.size() == 11);
  CHECK(table.find("i")->value.kind == TomlKind::integer);
  CHECK(table.find("i")->value.integer == -42);
  CHECK(table.find("i")->value.real == -42.0);
  CHECK(table.find("r")->value.kind == TomlKind::real);
  CHECK(table.find("r")->value.real == 2.5);
  CHECK(table.find("hex")->value.integer == 31);
  CHECK(table.find("s")->value.string == "a\tb");
  CHECK(table.find("lit")->value.string == "c\\d");
  CHECK(table.find("b")->value.boolean);
  CHECK(table.find("d")->value.kind == TomlKind::date_time);
  const TomlValue& array = table.find("a")->value;
  REQUIRE(array.items.size() == 3);
  CHECK(array.items[0].kind == TomlKind::integer);
  CHECK(array.items[1].kind == TomlKind::real);
  CHECK(array.items[2].string == "x");
  CHECK(table.find("t")->value.table.find("k")->value.integer == 1);
  CHECK(std::isnan(table.find("n")->value.real));
  CHECK(table.find("f")->value.real == -std::numeric_limits<double>::infinity());
  CHECK(table.find("absent") == nullptr);
}

TEST_CASE("toml: keys keep the order of the text", "[formats][toml]") {
  const TomlTable table =
      parse("zeta = 1\nalpha = 2\n[rows]\nz = 1\nb = 2\na = { y = 1, x = 2 }\nc.q = 1\nc.p = 2\n");
  REQUIRE(table.size() == 3);
  CHECK(table.entries()[0].key == "zeta");
  CHECK(table.entries()[1].key == "alpha");
  const auto& rows = table.entries()[2].value.table.entries();
  REQUIRE(rows.size() == 4);
  CHECK(rows[0].key == "z");
  CHECK(rows[1].key == "b");
  CHECK(rows[2].key == "a");
  CHECK(rows[2].value.table.entries()[0].key == "y");
  CHECK(rows[3].value.table.entries()[0].key == "q");
}

TEST_CASE("toml: places of keys, values, tables and items", "[formats][toml]") {
  const TomlTable table =
      parse("a = 1\n\n[t]\n  key =  [1,\n    22]\n[[l]]\nx = 1\n[[l]]\nx = 2\n");
  check_place(table.find("a")->where, 1, 1);
  check_place(table.find("a")->value.where, 1, 5);
  check_place(table.find("t")->value.where, 3, 1);
  const TomlEntry& key = *table.find("t")->value.table.find("key");
  check_place(key.where, 4, 3);
  check_place(key.value.where, 4, 10);
  check_place(key.value.items[0].where, 4, 11);
  check_place(key.value.items[1].where, 5, 5);
  const auto& list = table.find("l")->value.items;
  REQUIRE(list.size() == 2);
  check_place(list[0].where, 6, 1);
  check_place(list[1].where, 8, 1);
  check_place(list[1].table.find("x")->value.where, 9, 5);
}

TEST_CASE("toml: columns count bytes", "[formats][toml]") {
  // Two-byte, three-byte and four-byte characters before the key.
  const std::string before = "t = { s = \"\xC3\xA4\xE2\x82\xAC\xF0\x9F\x98\x80\", ";
  const TomlTable table = parse("x = 0\n" + before + "k = 1 }\ny = 2\n");
  const TomlEntry& key = *table.find("t")->value.table.find("k");
  check_place(key.where, 2, static_cast<int>(before.size()) + 1);
  check_place(key.value.where, 2, static_cast<int>(before.size()) + 5);
  check_place(table.find("y")->value.where, 3, 5);
}

TEST_CASE("toml: line ends of Windows and a byte order mark", "[formats][toml]") {
  const TomlTable table = parse(
      "\xEF\xBB\xBF"
      "a = 1\r\nb = \"x\"\r\n");
  CHECK(table.find("b")->value.string == "x");
  check_place(table.find("b")->value.where, 2, 5);
}

TEST_CASE("toml: broken text is an error at its place", "[formats][toml]") {
  struct Case {
    const char* text;
    int line;
  };
  const Case cases[] = {{"a = 1\nb = \n", 2},
                        {"a = 1\na = 2\n", 2},
                        {"x = \"open\ny = 1\n", 1},
                        {"[t\nx = 1\n", 1},
                        {"a = 1\nb = [1, 2\n", 2},
                        {"a = 12x\n", 1},
                        {"a = 99999999999999999999\n", 1},
                        {"a = 1\n[a]\n", 2},
                        {"a = \"\\q\"\n", 1},
                        {"= 1\n", 1},
                        {"a = 1 b = 2\n", 1},
                        {"[[[a]]]\n", 1},
                        {"a = 1\n[[=\n", 2},
                        {"[[", 1},
                        {"[", 1},
                        {"a = 1\n[[ ]]\n", 2},
                        {"a.", 1},
                        {"a = {", 1},
                        {"a = { b.", 1}};
  for (const Case& c : cases) {
    INFO(c.text);
    const Diagnostic diagnostic = failure(c.text);
    CHECK(diagnostic.code == "MF101");
    CHECK(diagnostic.where.line == c.line);
    CHECK(diagnostic.where.column >= 1);
    CHECK(diagnostic.text.size() > 12);
  }
  CHECK(failure(std::string("a = 1\n\0b = 2\n", 13)).code == "MF101");
  CHECK(failure("a = \"\xC3\x28\"\n").code == "MF101");
}

TEST_CASE("toml: characters that are not ASCII stand in quotes and comments only",
          "[formats][toml]") {
  std::size_t tried = 0;
  // Every place of a character outside of a string: as and in a value, a key, a table's name.
  for (char32_t c = 0xA0; c < 0xFFFE; c += c < 0x700 ? 1 : 97) {
    if (c >= 0xD800 && c < 0xE000) continue;
    std::string utf8;
    if (c >= 0x800) utf8 += static_cast<char>(0xE0 | (c >> 12));
    utf8 += static_cast<char>(c >= 0x800 ? 0x80 | ((c >> 6) & 0x3F) : 0xC0 | (c >> 6));
    utf8 += static_cast<char>(0x80 | (c & 0x3F));
    for (const std::string& bad :
         {"a = " + utf8, "a = [0, " + utf8 + "]", utf8 + " = 1", "a" + utf8 + " = 1",
          "[" + utf8 + "]", "a = 1 " + utf8, "a = \"\"\"x\"\"\"\"\"\n" + utf8 + " = 1"}) {
      const auto result = parse_toml("k = 1\n" + bad + "\n", "t.toml");
      REQUIRE_FALSE(result.ok());
      const Diagnostic& d = result.diagnostics()[0];
      const std::string before = "k = 1\n" + bad.substr(0, bad.find(utf8));
      REQUIRE(d.code == "MF101");
      REQUIRE(d.where.line == 1 + std::count(before.begin(), before.end(), '\n'));
      REQUIRE(d.where.column == static_cast<int>(before.size() - before.rfind('\n')));
      ++tried;
    }
    for (const std::string& good :
         {"a = \"" + utf8 + "\"", "a = '" + utf8 + "'", "\"" + utf8 + "\" = 1", "a = 1 # " + utf8,
          "a = \"\"\"\n" + utf8 + "\"\"\"\"\nb = '''" + utf8 + "'''"}) {
      INFO(good);
      const auto r = parse_toml(good + "\n", "t.toml");
      INFO((r.ok() ? "" : to_string(r.diagnostics()[0])));
      REQUIRE(r.ok());
    }
  }
  CHECK(tried > 10'000);
}

TEST_CASE("toml: deep and huge text is refused, not followed", "[formats][toml]") {
  const int deep = 100000;
  CHECK(failure("a = " + repeat("[", deep)).code == "MF102");
  CHECK(failure("a = " + repeat("[", deep) + repeat("]", deep)).code == "MF102");
  CHECK(failure("a = " + repeat("{a=", deep)).code == "MF102");
  CHECK(failure(repeat("a.", deep) + "a = 1").code == "MF102");
  CHECK(failure("[" + repeat("a.", deep) + "a]").code == "MF102");
  CHECK(failure("[" + repeat("\"a\" . ", deep) + "a]").code == "MF102");
  CHECK(failure(repeat("x", static_cast<int>(kMaxTomlBytes) + 1)).code == "MF102");
  check_place(failure("b = 1\na = " + repeat("[", 40)).where, 2, 5 + kMaxTomlNesting);
  // At the limit, and brackets that do not nest.
  const std::string open = repeat("[", kMaxTomlNesting);
  CHECK(parse("a = " + open + repeat("]", kMaxTomlNesting)).size() == 1);
  CHECK(parse(repeat("k.", kMaxTomlKeyParts - 1) + "k = 1.5\n").size() == 1);
  const std::string brackets = repeat("[", 50);
  CHECK(parse("a = \"" + brackets + "\\\"\"\nb = '" + brackets + "'\n# " + brackets +
              "\nc = \"\"\"\n" + brackets + "\"\"\"\nd = '''" + brackets + "'''\n")
            .size() == 4);
  CHECK(parse(repeat("[[a]]\n", 1000)).find("a")->value.items.size() == 1000);
}

TEST_CASE("toml: any bytes end in a tree or in a located error", "[formats][toml]") {
  std::mt19937 random(3);
  const std::string alphabet = "ab.=\"'[]{},#\n\r\t \\-+_019eE:TZ\xC3\xA4\x80\xFF";
  int trees = 0;
  for (int i = 0; i < 20000; ++i) {
    std::string text;
    for (auto n = random() % 40; n > 0; --n) text += alphabet[random() % alphabet.size()];
    const auto result = parse_toml(text, "t.toml");
    trees += result.ok() ? 1 : 0;
    if (result.ok()) continue;
    REQUIRE(result.diagnostics().size() == 1);
    const auto lines = std::count(text.begin(), text.end(), '\n') + 1;
    CHECK(result.diagnostics()[0].where.line >= 1);
    CHECK(result.diagnostics()[0].where.line <= lines);
  }
  CHECK(trees > 100);
}
