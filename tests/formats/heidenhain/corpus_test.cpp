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
