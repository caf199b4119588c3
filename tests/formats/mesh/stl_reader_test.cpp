#include "formats/mesh/stl_reader.h"

#include <algorithm>
#include <catch2/catch.hpp>
#include <cstring>
#include <limits>
#include <random>

#include "kernels/core/contract.h"
#include "kernels/geometry/weld.h"
#include "tests/support/support.h"

using namespace smoothpost;

namespace {

struct Triangle {
  std::array<float, 3> normal;
  std::array<std::array<float, 3>, 3> corner;
};

const std::vector<Triangle> kTetrahedron = {
    {{0, 0, -1}, {{{0, 0, 0}, {0, 3.25F, 0}, {2, 0, 0}}}},
    {{0, -1, 0}, {{{0, 0, 0}, {2, 0, 0}, {0, 0, 700.125F}}}},
    {{-1, 0, 0}, {{{0, 0, 0}, {0, 0, 700.125F}, {0, 3.25F, 0}}}},
    {{0.85F, 0.52F, 0.002F}, {{{2, 0, 0}, {0, 3.25F, 0}, {0, 0, 700.125F}}}},
};

std::string binary(const std::vector<Triangle>& triangles, std::string header = "ours") {
  header.resize(80, ' ');
  const auto count = static_cast<std::uint32_t>(triangles.size());
  std::string out = header;
  out.append(reinterpret_cast<const char*>(&count), 4);
  for (const auto& t : triangles) {
    out.append(reinterpret_cast<const char*>(&t), 48);
    out.append(2, '\0');
  }
  return out;
}

std::string number(float value) {
  char buffer[40];
  std::snprintf(buffer, sizeof buffer, "%.9g", value);
  return buffer;
}

std::string ascii(const std::vector<Triangle>& triangles, const std::string& name = "part") {
  const auto numbers = [](const std::array<float, 3>& v) {
    return " " + number(v[0]) + " " + number(v[1]) + " " + number(v[2]) + "\n";
  };
  std::string out = "solid " + name + "\n";
  for (const auto& t : triangles) {
    out += "  facet normal" + numbers(t.normal) + "    outer loop\n";
    for (const auto& v : t.corner) out += "      vertex" + numbers(v);
    out += "    endloop\n  endfacet\n";
  }
  return out + "endsolid " + name + "\n";
}

std::string upper(std::string text) {
  for (char& c : text) c = static_cast<char>(std::toupper(static_cast<unsigned char>(c)));
  return text;
}

std::string with_crlf(const std::string& text) {
  std::string out;
  for (const char c : text) out += c == '\n' ? "\r\n" : std::string(1, c);
  return out;
}

void check_is_tetrahedron(const Result<StlMesh>& read, double scale = 1.0) {
  for (const auto& d : read.diagnostics()) UNSCOPED_INFO(to_string(d));
  REQUIRE(read.ok());
  REQUIRE(read.value().triangles() == kTetrahedron.size());
  for (std::size_t i = 0; i < read.value().corners.size(); ++i)
    for (std::size_t k = 0; k < 3; ++k)
      REQUIRE(
          read.value().corners[i][static_cast<int>(k)] ==
          Approx(scale * static_cast<double>(kTetrahedron[i / 3].corner[i % 3][k])).epsilon(2e-7));
}

/// The one error of a file that is refused.
Diagnostic refusal(const std::string& bytes) {
  const auto read = read_stl(bytes, "p.stl");
  REQUIRE_FALSE(read.ok());
  REQUIRE_FALSE(read.diagnostics().empty());
  const Diagnostic first = read.diagnostics().front();
  CHECK(first.severity == Severity::error);
  CHECK(first.where.file == "p.stl");
  UNSCOPED_INFO(to_string(first));
  return first;
}

bool contains(const std::string& text, const std::string& part) {
  return text.find(part) != std::string::npos;
}

}  // namespace

TEST_CASE("stl_reader: binary, coordinates as written", "[formats][mesh]") {
  const auto read = read_stl(binary(kTetrahedron), "p.stl");
  check_is_tetrahedron(read);
  CHECK(read.value().binary);
  CHECK(read.diagnostics().empty());
  CHECK(read.value().normals_against_winding == 0);
  for (std::size_t i = 0; i < 12; ++i)
    CHECK(read.value().corners[i].z() == static_cast<double>(kTetrahedron[i / 3].corner[i % 3][2]));
}

TEST_CASE("stl_reader: text in the layouts that programs write", "[formats][mesh]") {
  const std::string text = ascii(kTetrahedron);
  check_is_tetrahedron(read_stl(text, "p.stl"));
  check_is_tetrahedron(read_stl(upper(text), "p.stl"));
  check_is_tetrahedron(read_stl(with_crlf(text), "p.stl"));
  check_is_tetrahedron(read_stl("\xef\xbb\xbf" + text, "p.stl"));
  check_is_tetrahedron(read_stl("\n  " + text + "\n\n", "p.stl"));
  check_is_tetrahedron(read_stl(ascii(kTetrahedron, "facet normal 1 vertex solid"), "p.stl"));
  std::string one_line = text.substr(text.find('\n') + 1);
  std::replace(one_line.begin(), one_line.end(), '\n', '\t');
  check_is_tetrahedron(read_stl("solid\n" + one_line, "p.stl"));
  CHECK_FALSE(read_stl(text, "p.stl").value().binary);
}

TEST_CASE("stl_reader: numbers of every form", "[formats][mesh]") {
  const std::string text =
      "solid\nfacet normal nan nan nan\nouter loop\nvertex +1.5 -2. .5\nvertex 1E1 1e-400 -0\n"
      "vertex 1.25e+02 0.000000000000000000000123 12345.6789012345678\nendloop\nendfacet\nendsolid";
  const auto read = read_stl(text, "p.stl");
  for (const auto& d : read.diagnostics()) UNSCOPED_INFO(to_string(d));
  REQUIRE(read.ok());
  const std::vector<Vec3> expected = {{1.5, -2, 0.5}, {10, 0, 0}, {125, 0, 12345.6789012345678}};
  for (std::size_t i = 0; i < 3; ++i)
    for (int k = 0; k < 3; ++k)
      CHECK(read.value().corners[i][k] == Approx(expected[i][k]).epsilon(2e-7).margin(1e-20));
}

TEST_CASE("stl_reader: several solids, empty ones among them", "[formats][mesh]") {
  const std::string half = ascii({kTetrahedron.begin(), kTetrahedron.begin() + 2}, "first half");
  const std::string rest = ascii({kTetrahedron.begin() + 2, kTetrahedron.end()}, "");
  const auto read = read_stl(half + "solid nothing\nendsolid\n" + rest, "p.stl");
  check_is_tetrahedron(read);
  CHECK(read.value().solids == std::vector<std::string>{"first half", "nothing", ""});
}

TEST_CASE("stl_reader: binary files whose header begins with solid", "[formats][mesh]") {
  check_is_tetrahedron(read_stl(binary(kTetrahedron, "solid from some CAD"), "p.stl"));
  check_is_tetrahedron(read_stl(binary(kTetrahedron, std::string("solid\0\0x", 8)), "p.stl"));
  check_is_tetrahedron(read_stl(binary(kTetrahedron, "COLOR=abcd"), "p.stl"));
  check_is_tetrahedron(read_stl(binary(kTetrahedron, "\xef\xbb\xbf"), "p.stl"));
  check_is_tetrahedron(read_stl(binary(kTetrahedron, "\xff\xfe"), "p.stl"));
  auto cut = binary(kTetrahedron, "solid cut off");
  cut.resize(cut.size() - 30);
  CHECK(refusal(cut).code == "STL102");
}

TEST_CASE("stl_reader: scale", "[formats][mesh]") {
  check_is_tetrahedron(read_stl(binary(kTetrahedron), "p.stl", {.scale = 25.4}), 25.4);
  check_is_tetrahedron(read_stl(ascii(kTetrahedron), "p.stl", {.scale = 0.001}), 0.001);
  CHECK_THROWS_AS(read_stl("", "p.stl", {.scale = 0.0}), ContractViolation);
  CHECK_THROWS_AS(read_stl("", "p.stl", {.scale = std::numeric_limits<double>::infinity()}),
                  ContractViolation);
}

TEST_CASE("stl_reader: truncated and lying binary headers are refused with the numbers",
          "[formats][mesh]") {
  const std::string good = binary(kTetrahedron);
  const auto with_count = [&](std::uint32_t count) {
    std::string bytes = good;
    std::memcpy(bytes.data() + 80, &count, 4);
    return bytes;
  };
  const auto cut = refusal(good.substr(0, 200));
  CHECK(cut.code == "STL102");
  CHECK(contains(cut.text, "header says 4 triangles = 284 bytes, file has 200"));
  // 4,294,967,295 triangles would be 214 GB: refused by arithmetic, not by memory.
  const auto huge = refusal(with_count(0xffffffffU));
  CHECK(huge.code == "STL102");
  CHECK(contains(huge.text, "214748364834 bytes"));
  const auto few = refusal(with_count(3));
  CHECK(few.code == "STL103");
  CHECK(contains(few.text, "room for 1 more"));
  CHECK(refusal(with_count(0)).code == "STL103");
  CHECK(refusal("").code == "STL101");
  CHECK(refusal("PK\x03\x04").code == "STL105");
  CHECK(refusal(binary({})).code == "STL109");
}

TEST_CASE("stl_reader: a few bytes after the last triangle are a warning", "[formats][mesh]") {
  const auto read = read_stl(binary(kTetrahedron) + "made by us\n", "p.stl");
  check_is_tetrahedron(read);
  REQUIRE(read.diagnostics().size() == 1);
  CHECK(read.diagnostics()[0].code == "STL104");
  CHECK(read.diagnostics()[0].severity == Severity::warning);
  CHECK(contains(read.diagnostics()[0].text, "11 bytes"));
}

TEST_CASE("stl_reader: coordinates that cannot be", "[formats][mesh]") {
  for (const float bad : {std::numeric_limits<float>::quiet_NaN(),
                          -std::numeric_limits<float>::infinity(), 1e38F, 2e6F}) {
    auto triangles = kTetrahedron;
    triangles[2].corner[1][2] = bad;
    const auto in_binary = refusal(binary(triangles));
    CHECK(in_binary.code == "STL108");
    // 84 + 2 triangles + normal + corner 1 + z.
    CHECK(contains(in_binary.text, "triangle 3, byte " + std::to_string(84 + 100 + 12 + 12 + 8)));
    const auto in_text = refusal(ascii(triangles));
    CHECK(in_text.code == "STL108");
    CHECK(in_text.where.line == 1 + 2 * 7 + 4);
    CHECK(in_text.where.column == 18);  // "      vertex 0 0 <here>"
  }
  CHECK(refusal("solid\nfacet normal 0 0 1\nouter loop\nvertex 1e400 0 0\nvertex 1 0 0\nvertex 0 1 "
                "0\nendloop\nendfacet\nendsolid")
            .code == "STL108");
  // What a scale makes too large.
  CHECK_FALSE(read_stl(binary(kTetrahedron), "p.stl", {.scale = 1e4}).ok());
}

TEST_CASE("stl_reader: text that is no STL is located", "[formats][mesh]") {
  std::string text = ascii(kTetrahedron);
  const auto replaced = [&](const std::string& from, const std::string& to) {
    std::string out = text;
    out.replace(out.find(from), from.size(), to);
    return out;
  };
  const auto word = refusal(replaced("outer loop", "outer lop"));
  CHECK(word.code == "STL106");
  CHECK(word.where.line == 3);
  CHECK(word.where.column == 11);
  CHECK(contains(word.text, "expected `loop`, found `lop`"));
  CHECK(refusal(replaced("700.125", "700,125")).code == "STL106");
  CHECK(refusal(replaced("endfacet", "")).code == "STL106");
  CHECK(refusal(text + "rubbish").code == "STL106");
  const auto cut = refusal(text.substr(0, text.rfind("endsolid")));
  CHECK(cut.code == "STL107");
  CHECK(contains(cut.text, "after 4 triangles"));
  CHECK(refusal(text.substr(0, text.size() / 2)).code == "STL107");
  CHECK(refusal("solid nothing\nendsolid nothing").code == "STL109");
}

TEST_CASE("stl_reader: stored normals against the winding are counted", "[formats][mesh]") {
  auto triangles = kTetrahedron;
  triangles[1].normal = {0, 1, 0};
  triangles[3].normal = {-1, 0, 0};
  triangles[0].normal = {0, 0, 0};  // not stated: no contradiction
  for (const auto& bytes : {binary(triangles), ascii(triangles)}) {
    const auto read = read_stl(bytes, "p.stl");
    check_is_tetrahedron(read);
    CHECK(read.value().normals_against_winding == 2);
    REQUIRE(read.diagnostics().size() == 1);
    CHECK(read.diagnostics()[0].code == "STL113");
    CHECK(contains(read.diagnostics()[0].text, "2 of 4"));
  }
}

TEST_CASE("stl_reader: every prefix and 10,000 mutations end in a value or diagnostics",
          "[formats][mesh]") {
  std::mt19937 random(17);
  std::size_t values = 0;
  std::size_t refused = 0;
  const auto run = [&](const std::string& bytes) {
    const auto read = read_stl(bytes, "p.stl");
    if (read.ok()) {
      REQUIRE(read.value().triangles() > 0);
      for (const Vec3& v : read.value().corners)
        REQUIRE((v.allFinite() && v.cwiseAbs().maxCoeff() <= 1.0001 * kLargestStlCoordinate));
      ++values;
    } else {
      REQUIRE(has_error(read.diagnostics()));
      ++refused;
    }
  };
  const std::vector<std::string> files = {binary(kTetrahedron, "solid of ours"),
                                          ascii(kTetrahedron)};
  std::size_t prefixes = 0;
  for (const auto& file : files)
    for (std::size_t n = 0; n < file.size(); ++n, ++prefixes) run(file.substr(0, n));
  CHECK(values <= 10);  // text without its last name or line end is whole
  CHECK(refused + values == prefixes);
  for (int i = 0; i < 10000; ++i) {
    std::string bytes = files[static_cast<std::size_t>(i % 2)];
    const int changes = 1 + static_cast<int>(random() % 3);
    for (int k = 0; k < changes; ++k)
      bytes[random() % bytes.size()] = static_cast<char>(random() % 256);
    run(bytes);
  }
  CHECK(values > 1000);
  CHECK(refused > 1000);
}

TEST_CASE("stl_reader: every STL of the corpus", "[formats][mesh]") {
  const auto files = test::corpus_files("5_stl", {".stl", "formatdetection"});
  if (files.empty()) {
    WARN("no reference material beside the checkout: nothing to test here");
    return;
  }
  std::size_t read_files = 0;
  std::size_t empty_files = 0;
  std::size_t triangles = 0;
  for (const auto& path : files) {
    const std::string bytes = test::read_bytes(path);
    const auto read = read_stl(bytes, path.filename().string());
    INFO(path.filename().string());
    for (const auto& d : read.diagnostics()) UNSCOPED_INFO(to_string(d));
    const bool empty = path.filename().string().find("empty") == 0 ||
                       path.filename().string().find("stl_empty") == 0;
    if (empty) {
      REQUIRE_FALSE(read.ok());
      CHECK(read.diagnostics()[0].code == "STL109");
      ++empty_files;
      continue;
    }
    REQUIRE(read.ok());
    ++read_files;
    triangles += read.value().triangles();
    if (read.value().binary) {
      CHECK(read.value().triangles() == (bytes.size() - 84) / 50);
    } else {
      std::size_t vertices = 0;
      const std::string text = upper(bytes);
      for (std::size_t at = text.find("VERTEX"); at != std::string::npos;
           at = text.find("VERTEX", at + 6))
        ++vertices;
      CHECK(read.value().corners.size() == vertices);
    }
    const auto mesh = weld(read.value().corners);
    const auto report = describe(mesh);
    CHECK(report.triangles == read.value().triangles());
    CHECK(report.vertices <= 3 * report.triangles);
    CHECK(report.components >= 1);
  }
  CHECK(empty_files == 3);
  CHECK(read_files + empty_files == files.size());
  WARN("read " << read_files << " files with " << triangles << " triangles");
}

TEST_CASE("stl_reader: the sheets of paper B's cases", "[formats][mesh]") {
  for (const char* name : {"reference/case1.stl", "reference/case2.stl"}) {
    const auto path = test::shared_path(name);
    if (!path) {
      WARN("no reference material beside the checkout: nothing to test here");
      return;
    }
    const auto read = read_stl(test::read_bytes(*path), name);
    REQUIRE(read.ok());
    const auto report = describe(weld(read.value().corners));
    CHECK(report.components == 1);
    CHECK(report.inconsistent.count == 0);
    CHECK(report.non_manifold.count == 0);
    CHECK(report.open.count > 0);
    CHECK_FALSE(report.closed());
  }
}
