#include "formats/mesh/stl_reader.h"

#include <assimp/scene.h>

#include <algorithm>
#include <array>
#include <assimp/Importer.hpp>
#include <cmath>
#include <cstring>
#include <optional>
#include <utility>

#include "kernels/core/signed_number.h"

namespace smoothpost {

namespace {

constexpr std::size_t kHeaderBytes = 84;    // 80 of text, 4 of the triangle count
constexpr std::size_t kTriangleBytes = 50;  // normal, three corners, attribute
constexpr std::size_t kMaxErrors = 20;

std::string number_text(double value) {
  std::array<char, 64> buffer;
  const auto end = std::to_chars(buffer.data(), buffer.data() + buffer.size(), value,
                                 std::chars_format::general, 9);
  return std::string(buffer.data(), end.ptr);
}

Diagnostic error(const std::string& file, const char* code, std::string text, int line = 0,
                 int column = 0) {
  return {Severity::error, code, std::move(text), {file, line, column}};
}

Diagnostic warning(const std::string& file, const char* code, std::string text) {
  return {Severity::warning, code, std::move(text), {file, 0, 0}};
}

bool is_blank(char c) { return c == ' ' || c == '\t' || c == '\v' || c == '\f' || c == '\r'; }

char lower(char c) { return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c; }

bool same_word(std::string_view text, std::string_view word) {
  return text.size() == word.size() && std::equal(text.begin(), text.end(), word.begin(),
                                                  [](char a, char b) { return lower(a) == b; });
}

/// What the reader knows of a file before assimp sees it. `bytes` is what assimp is given.
struct Judged {
  std::string bytes;
  std::size_t triangles = 0;
  bool binary = true;
  std::vector<std::string> solids;
};

/// Finite, and in mm not above the limit.
bool coordinate_ok(double value, double scale) {
  return std::isfinite(value) && std::abs(value * scale) <= kLargestStlCoordinate;
}

std::string coordinate_complaint(std::string_view written, double scale) {
  return "coordinate " + std::string(written) + " is not a number of at most " +
         number_text(kLargestStlCoordinate / scale) + (scale == 1.0 ? " mm" : " (scaled)") +
         "; the file is damaged, or its unit is not what you think";
}

// ---- binary
// ------------------------------------------------------------------------------------------

std::uint32_t stated_count(std::string_view bytes) {
  std::uint32_t count = 0;
  for (int i = 3; i >= 0; --i)
    count = count << 8 | static_cast<unsigned char>(bytes[80 + static_cast<std::size_t>(i)]);
  return count;
}

std::optional<Diagnostic> count_against_size(std::string_view bytes, const std::string& file) {
  const std::size_t stated = stated_count(bytes);
  const std::size_t expected = kHeaderBytes + stated * kTriangleBytes;
  const std::string compare = "header says " + std::to_string(stated) +
                              " triangles = " + std::to_string(expected) + " bytes, file has " +
                              std::to_string(bytes.size());
  if (bytes.size() < expected)
    return error(file, "STL102",
                 "truncated: " + compare + ", which ends in triangle " +
                     std::to_string((bytes.size() - kHeaderBytes) / kTriangleBytes + 1) +
                     "; export or copy the file again");
  if (bytes.size() - expected >= kTriangleBytes)
    return error(file, "STL103",
                 "the triangle count is wrong: " + compare + ", room for " +
                     std::to_string((bytes.size() - expected) / kTriangleBytes) +
                     " more triangles; export the file again");
  return std::nullopt;
}

/// The first coordinates of a binary file that cannot be, with their byte offsets.
Diagnostics bad_binary_coordinates(std::string_view bytes, std::size_t triangles,
                                   const std::string& file, double scale) {
  Diagnostics found;
  for (std::size_t t = 0; t < triangles && found.size() < kMaxErrors; ++t) {
    std::array<float, 9> corner;
    const std::size_t at = kHeaderBytes + t * kTriangleBytes + 12;
    std::memcpy(corner.data(), bytes.data() + at, sizeof corner);
    for (std::size_t k = 0; k < corner.size(); ++k)
      if (!coordinate_ok(corner[k], scale)) {
        found.push_back(error(
            file, "STL108",
            "triangle " + std::to_string(t + 1) + ", byte " + std::to_string(at + 4 * k) + ": " +
                coordinate_complaint(std::isnan(corner[k]) ? "NaN" : number_text(corner[k]),
                                     scale)));
        break;
      }
  }
  return found;
}

Result<Judged> judge_binary(std::string_view bytes, const std::string& file, double scale) {
  if (auto wrong = count_against_size(bytes, file)) return Result<Judged>::failure(*wrong);
  Judged judged;
  judged.triangles = stated_count(bytes);
  if (judged.triangles == 0)
    return Result<Judged>::failure(error(file, "STL109", "the file holds no triangle"));
  Diagnostics found = bad_binary_coordinates(bytes, judged.triangles, file, scale);
  if (has_error(found)) return Result<Judged>::failure(std::move(found));
  const std::size_t size = kHeaderBytes + judged.triangles * kTriangleBytes;
  if (bytes.size() > size)
    found.push_back(warning(file, "STL104",
                            std::to_string(bytes.size() - size) +
                                " bytes after the last triangle (from byte " +
                                std::to_string(size) + ") are left out"));
  judged.bytes.assign(bytes.substr(0, size));
  // The 80 bytes of text mean nothing to us; to assimp they may look like a byte order mark or a
  // colour.
  std::fill_n(judged.bytes.begin(), 80, ' ');
  return Result<Judged>(std::move(judged), std::move(found));
}

// ---- text
// --------------------------------------------------------------------------------------------

struct Token {
  std::string_view text;  ///< empty at the end of the file
  int line = 0;
  int column = 0;
};

/// Words of a text with their places.
class Scanner {
 public:
  explicit Scanner(std::string_view text) : text_(text) {}

  Token next() {
    while (at_ < text_.size() && (is_blank(text_[at_]) || text_[at_] == '\n')) {
      if (text_[at_] == '\n') new_line();
      ++at_;
    }
    const std::size_t begin = at_;
    while (at_ < text_.size() && !is_blank(text_[at_]) && text_[at_] != '\n') ++at_;
    return {text_.substr(begin, at_ - begin), line_, static_cast<int>(begin - line_begin_) + 1};
  }

  /// What is left of the line, without blanks around it.
  std::string_view rest_of_line() {
    std::size_t end = text_.find('\n', at_);
    if (end == std::string_view::npos) end = text_.size();
    std::string_view rest = text_.substr(at_, end - at_);
    at_ = end;
    while (!rest.empty() && is_blank(rest.front())) rest.remove_prefix(1);
    while (!rest.empty() && is_blank(rest.back())) rest.remove_suffix(1);
    return rest;
  }

 private:
  void new_line() {
    ++line_;
    line_begin_ = at_ + 1;
  }
  std::string_view text_;
  std::size_t at_ = 0;
  std::size_t line_begin_ = 0;
  int line_ = 1;
};

/// Reads the grammar of a text STL: counts triangles, names what does not belong, and writes the
/// same numbers again in the one layout that assimp's text reader is sure to take.
class TextJudge {
 public:
  TextJudge(std::string_view text, const std::string& file, double scale)
      : scan_(text), file_(file), scale_(scale) {}

  Result<Judged> run() {
    Token token = scan_.next();
    while (!token.text.empty() && found_.empty()) {
      if (!same_word(token.text, "solid")) {
        complain(token, "expected `solid`");
        break;
      }
      judged_.solids.emplace_back(scan_.rest_of_line());
      judged_.bytes += "solid\n";
      read_solid(token);
      judged_.bytes += "endsolid\n";
      token = scan_.next();
    }
    if (has_error(found_)) return Result<Judged>::failure(std::move(found_));
    if (judged_.triangles == 0)
      return Result<Judged>::failure(error(file_, "STL109", "the file holds no triangle"));
    judged_.binary = false;
    return Result<Judged>(std::move(judged_));
  }

 private:
  void read_solid(const Token& begin) {
    for (Token token = scan_.next(); found_.size() < kMaxErrors; token = scan_.next()) {
      if (token.text.empty()) {
        found_.push_back(error(file_, "STL107",
                               "truncated: the text ends inside the solid that begins in line " +
                                   std::to_string(begin.line) + ", after " +
                                   std::to_string(judged_.triangles) +
                                   " triangles, without `endsolid`; export or copy the file again",
                               token.line, token.column));
        return;
      }
      if (same_word(token.text, "endsolid")) {
        scan_.rest_of_line();
        return;
      }
      if (!same_word(token.text, "facet")) return complain(token, "expected `facet` or `endsolid`");
      if (!read_facet()) return;
    }
  }

  bool read_facet() {
    judged_.bytes += "facet normal";
    if (!expect("normal") || !read_numbers(3, false)) return false;
    if (!expect("outer") || !expect("loop")) return false;
    judged_.bytes += "\nouter loop\n";
    for (int corner = 0; corner < 3; ++corner) {
      judged_.bytes += "vertex";
      if (!expect("vertex") || !read_numbers(3, true)) return false;
      judged_.bytes += '\n';
    }
    if (!expect("endloop") || !expect("endfacet")) return false;
    judged_.bytes += "endloop\nendfacet\n";
    ++judged_.triangles;
    return true;
  }

  bool expect(const char* word) {
    const Token token = scan_.next();
    if (same_word(token.text, word)) return true;
    complain(token, "expected `" + std::string(word) + "`");
    return false;
  }

  bool read_numbers(int count, bool coordinates) {
    for (int i = 0; i < count; ++i) {
      const Token token = scan_.next();
      const std::string_view digits = token.text;
      double value = 0.0;
      const auto end = from_signed(digits, value);
      if (end.ec == std::errc::invalid_argument || end.ptr != digits.data() + digits.size()) {
        complain(token, "expected a number");
        return false;
      }
      // Out of range is too small for a double, which is 0, or too large, which has no minus
      // exponent.
      const bool tiny = end.ec == std::errc::result_out_of_range &&
                        digits.find("e-") + digits.find("E-") != 2 * std::string_view::npos;
      const bool fits = tiny || (end.ec == std::errc() && coordinate_ok(value, scale_));
      // Normals do not make the shape: some programs write NaN for a triangle without area.
      if (coordinates && !fits)
        found_.push_back(error(file_, "STL108",
                               coordinate_complaint(token.text.substr(0, 40), scale_), token.line,
                               token.column));
      judged_.bytes += ' ';
      if (fits && !tiny)
        judged_.bytes += digits;
      else
        judged_.bytes += '0';
    }
    return true;
  }

  void complain(const Token& token, const std::string& what) {
    if (token.text.empty()) {
      found_.push_back(error(file_, "STL107",
                             "truncated: " + what + ", the text ends after " +
                                 std::to_string(judged_.triangles) +
                                 " triangles; export or copy the file again",
                             token.line, token.column));
      return;
    }
    found_.push_back(error(file_, "STL106",
                           what + ", found `" + std::string(token.text.substr(0, 40)) + "`",
                           token.line, token.column));
  }

  Scanner scan_;
  const std::string& file_;
  double scale_;
  Judged judged_;
  Diagnostics found_;
};

std::string_view without_byte_order_mark(std::string_view bytes) {
  if (bytes.substr(0, 3) == "\xef\xbb\xbf") bytes.remove_prefix(3);
  return bytes;
}

bool looks_like_text(std::string_view bytes) {
  const std::string_view first = bytes.substr(0, 4096);
  if (std::any_of(first.begin(), first.end(), [](char c) {
        const auto u = static_cast<unsigned char>(c);
        return (u < 32 && !is_blank(c) && c != '\n') || u == 127;
      }))
    return false;
  return same_word(Scanner(bytes).next().text, "solid");
}

/// Binary by its size, else text by its content, else binary with a wrong size.
Result<Judged> judge(std::string_view bytes, const std::string& file, double scale) {
  if (bytes.empty()) return Result<Judged>::failure(error(file, "STL101", "the file is empty"));
  const bool exact =
      bytes.size() >= kHeaderBytes &&
      bytes.size() == kHeaderBytes + kTriangleBytes * std::size_t{stated_count(bytes)};
  const std::string_view text = without_byte_order_mark(bytes);
  if (!exact && looks_like_text(text)) {
    return TextJudge(text, file, scale).run();
  }
  if (bytes.size() < kHeaderBytes)
    return Result<Judged>::failure(error(
        file, "STL105",
        "not an STL file: " + std::to_string(bytes.size()) +
            " bytes, neither text that begins with `solid` nor the 84 bytes of a binary header"));
  return judge_binary(bytes, file, scale);
}

// ---- assimp
// ------------------------------------------------------------------------------------------

/// Copies one triangle; true when its stored normal points against its winding.
bool append_triangle(const aiMesh& mesh, const aiFace& face, double scale,
                     std::vector<Vec3>& corners) {
  std::array<Vec3, 3> corner;
  for (unsigned k = 0; k < 3; ++k) {
    const aiVector3D& v = mesh.mVertices[face.mIndices[k]];
    corner[k] = scale * Vec3(v.x, v.y, v.z);
    corners.push_back(corner[k]);
  }
  if (!mesh.mNormals) return false;
  const aiVector3D& stored = mesh.mNormals[face.mIndices[0]];
  const Vec3 wound = (corner[1] - corner[0]).cross(corner[2] - corner[0]);
  return wound.dot(Vec3(stored.x, stored.y, stored.z)) < 0.0;
}

Result<StlMesh> read_through_assimp(const Judged& judged, const std::string& file, double scale) {
  Assimp::Importer importer;
  const aiScene* scene =
      importer.ReadFileFromMemory(judged.bytes.data(), judged.bytes.size(), 0, "stl");
  if (!scene)
    return Result<StlMesh>::failure(error(
        file, "STL110", "assimp refuses the file: " + std::string(importer.GetErrorString())));
  StlMesh out;
  out.binary = judged.binary;
  out.solids = judged.solids;
  out.corners.reserve(3 * judged.triangles);
  for (unsigned m = 0; m < scene->mNumMeshes; ++m) {
    const aiMesh& mesh = *scene->mMeshes[m];
    for (unsigned f = 0; f < mesh.mNumFaces; ++f)
      if (mesh.mFaces[f].mNumIndices == 3)
        out.normals_against_winding += append_triangle(mesh, mesh.mFaces[f], scale, out.corners);
  }
  if (out.triangles() != judged.triangles)
    return Result<StlMesh>::failure(error(file, "STL111",
                                          "assimp finds " + std::to_string(out.triangles()) +
                                              " triangles, the file holds " +
                                              std::to_string(judged.triangles)));
  return out;
}

}  // namespace

Result<StlMesh> read_stl(std::string_view bytes, const std::string& file_name,
                         const StlSettings& settings) {
  require(std::isfinite(settings.scale) && settings.scale > 0.0, "STL scale above 0");
  auto judged = judge(bytes, file_name, settings.scale);
  if (!judged.ok()) return Result<StlMesh>::failure(judged.diagnostics());
  constexpr std::size_t kMostTriangles = 0xfffffffeU / 3;
  if (judged.value().triangles > kMostTriangles)
    return Result<StlMesh>::failure(
        error(file_name, "STL112",
              std::to_string(judged.value().triangles) + " triangles are more than " +
                  std::to_string(kMostTriangles) + ", the most that are read"));
  auto mesh = read_through_assimp(judged.value(), file_name, settings.scale);
  if (!mesh.ok()) return mesh;
  Diagnostics diagnostics = judged.diagnostics();
  if (const auto against = mesh.value().normals_against_winding)
    diagnostics.push_back(
        warning(file_name, "STL113",
                std::to_string(against) + " of " + std::to_string(judged.value().triangles) +
                    " triangles have a stored normal against their winding; the winding counts"));
  return Result<StlMesh>(std::move(mesh.value()), std::move(diagnostics));
}

}  // namespace smoothpost
