#include <catch2/catch.hpp>
#include <filesystem>
#include <map>
#include <random>

#include "tests/formats/heidenhain/recording.h"
#include "tests/support/support.h"

// Real programs that nobody of this project wrote, and the sample of the notes on dialects.
namespace smoothpost::test {
namespace {

struct File {
  std::filesystem::path path;
  std::string text;
};

const std::vector<File>& programs() {
  static const std::vector<File> files = [] {
    std::vector<File> out;
    for (const auto& path : corpus_files("2_apt_cl", {".h"}))
      out.push_back({path, read_bytes(path)});
    if (const auto path = shared_path("dialects/samples/heidenhain.h"))
      out.push_back({*path, read_bytes(*path)});
    return out;
  }();
  return files;
}

bool corpus_missing() {
  if (!programs().empty()) return false;
  WARN("no corpus beside the checkout: skipped");
  return true;
}

std::string boss(const char* name) {
  return read_bytes(
      *shared_path(std::string("corpus/2_apt_cl/aamorim1913/tests/parts-tools/boss/") + name));
}

/// The greatest distance of the places of two motions at equal shares, mm.
double distance_of(const CanonicalMotion& a, const CanonicalMotion& b) {
  double worst = 0.0;
  for (const double s : {0.0, 0.25, 0.5, 0.75, 1.0}) {
    const auto at = [s](const CanonicalMotion& m) -> Vec3 {
      if (m.is_arc) return arc_at(m, s);
      return start_of(m) + s * (end_of(m) - start_of(m));
    };
    worst = std::max(worst, (at(a) - at(b)).norm());
  }
  return worst;
}

struct Comparison {
  std::size_t motions = 0;
  std::size_t arcs = 0;
  std::size_t other_kind = 0;  ///< a rapid of one is a feed of the other
  std::size_t left_out = 0;    ///< of the CL data: they change nothing in the post's decimals
  std::vector<double> distances;
  std::string fault;
};

/// Pairs the motions of the post's program with those of the CL data, in order.
Comparison compare(const std::vector<CanonicalMotion>& cl, std::size_t first,
                   const std::vector<CanonicalMotion>& post) {
  Comparison out;
  std::vector<CanonicalMotion> known;
  for (const CanonicalMotion& m : post)
    if (!m.machine_position) known.push_back(m);
  std::size_t i = 0;
  Vec3 last = Vec3::Constant(1e9);
  for (std::size_t k = first; k < cl.size() && i < known.size(); ++k) {
    const CanonicalMotion& m = cl[k];
    if ((end_of(m) - last).cwiseAbs().maxCoeff() < 0.001 && !m.is_arc) {
      ++out.left_out;
      continue;
    }
    last = end_of(m);
    const CanonicalMotion& mine = known[i++];
    const bool left = m.arc.sweep * m.arc.normal.z() > 0.0;
    const bool same = mine.is_arc == m.is_arc && (!m.is_arc || (mine.arc.sweep > 0.0) == left);
    if (!same) {
      out.fault = "line " + std::to_string(m.line) +
                  " of the CL data is another motion than line " + std::to_string(mine.line) +
                  " of the program";
      return out;
    }
    ++out.motions;
    out.arcs += m.is_arc ? 1 : 0;
    out.other_kind += mine.kind != m.kind ? 1 : 0;
    // Behind a position of the machine the program names X and Y first: Z is not known there.
    const bool whole = ((mine.unknown_start | mine.unknown_end) & 7) == 0;
    const Vec3 off = end_of(m) - end_of(mine);
    out.distances.push_back(whole ? distance_of(m, mine) : std::hypot(off.x(), off.y()));
  }
  if (i != known.size()) out.fault = "motions of the program are left over";
  std::sort(out.distances.begin(), out.distances.end());
  return out;
}

}  // namespace

TEST_CASE("corpus: what becomes of every conversational program", "[formats][heidenhain][corpus]") {
  if (corpus_missing()) return;
  nc::InterpreterSettings settings;
  settings.any_axis_needs_machine = false;
  std::map<std::string, int> reasons;
  int read = 0;
  for (const File& file : programs()) {
    const auto r = read_program(file.text, settings);
    INFO(file.path.string() << "\n" << r.all_text());
    if (r.ok) {
      ++read;
      continue;
    }
    const auto error = std::find_if(r.diagnostics.begin(), r.diagnostics.end(),
                                    [](const auto& d) { return d.severity == Severity::error; });
    REQUIRE(error != r.diagnostics.end());
    CHECK(error->where.line > 0);
    CHECK(error->where.column > 0);
    ++reasons[error->code + " " + error->text.substr(0, error->text.find(" is "))];
  }
  std::string table;
  for (const auto& [reason, count] : reasons)
    table += "\n  " + std::to_string(count) + "  " + reason;
  WARN(read << " of " << programs().size()
            << " programs read; first reason of the others:" << table);
  // Every program that asks nothing of the running control is read.
  CHECK(read + reasons["NC402 FN 18"] == static_cast<int>(programs().size()));
  CHECK(read >= 16);
}

TEST_CASE("corpus: boss.apt and the programs that an independent post made of it",
          "[formats][heidenhain][corpus]") {
  if (corpus_missing()) return;
  cl::ReaderSettings settings;
  settings.process.unmapped = UnmappedWords::comment;
  const auto path = shared_path("corpus/2_apt_cl/aamorim1913/parts-tools/boss.apt.gz");
  REQUIRE(path);
  const ClRun apt = read_cl(read_bytes(*path), settings);
  INFO(apt.all_text());
  REQUIRE(apt.ok);
  const auto r = read_program(boss("11.h"));
  INFO(r.all_text());
  REQUIRE(r.ok);
  const Comparison c = compare(apt.sink.motions, 0, r.sink.motions);
  INFO(c.fault);
  CHECK(c.fault.empty());
  REQUIRE(!c.distances.empty());
  const auto share = [&](double s) {
    return c.distances[static_cast<std::size_t>(s * static_cast<double>(c.distances.size() - 1))];
  };
  WARN("boss.apt, first setup, at five places of each motion: "
       << c.motions << " motions, " << c.arcs << " arcs, " << c.left_out
       << " left out by the post, " << c.other_kind
       << " rapids of one that are feeds of the other; distance median " << share(0.5)
       << " mm, 99 % " << share(0.99) << " mm, largest " << share(1.0) << " mm");
  CHECK(c.motions > 4000);
  CHECK(c.arcs > 500);
  // Three decimals on each side: half a thousandth an axis, and what the circle makes of it.
  CHECK(share(0.5) < 0.0009);
  CHECK(share(1.0) < 0.003);
}

TEST_CASE("corpus: prefixes and mutations end in values or located messages",
          "[formats][heidenhain][corpus]") {
  if (corpus_missing()) return;
  std::mt19937 random(12);
  std::size_t runs = 0;
  for (const File& file : programs()) {
    const std::string text = file.text.substr(0, 3000);
    const auto expect = [&](const std::string& changed) {
      const auto r = read_program(changed);
      ++runs;
      REQUIRE(r.ok == r.errors().empty());
      for (const CanonicalMotion& m : r.sink.motions)
        for (const double value : m.end) REQUIRE(std::isfinite(value));
    };
    for (std::size_t n = 0; n < text.size(); n += 97) expect(text.substr(0, n));
    for (int i = 0; i < 40; ++i) {
      std::string changed = text;
      for (int k = 0; k < 3; ++k)
        changed[random() % changed.size()] = "QLXM0+-.~;\"\n(CR "[random() % 16];
      expect(changed);
    }
  }
  CHECK(runs > 500);
}

}  // namespace smoothpost::test
