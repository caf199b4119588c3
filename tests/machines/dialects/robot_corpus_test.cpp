// Robot programs of others: read, or refused with a message that names the construct.
#include <map>

#include "machines/dialects/fanuc_ls.h"
#include "machines/dialects/krl.h"
#include "machines/dialects/rapid.h"
#include "tests/machines/dialects/random_programs.h"

using namespace smoothpost;
using namespace smoothpost::test;

TEST_CASE("robot programs of the corpus are read or refused by name", "[machines][dialects]") {
  struct Language {
    const Dialect* dialect;
    const char* name;
    std::vector<std::string> extensions;
    std::size_t files;
  };
  const Language languages[] = {{&krl::kDialect, "krl", {".src", ".SRC"}, 6},
                                {&rapid::kDialect, "rapid", {".mod"}, 4},
                                {&fanuc_ls::kDialect, "fanuc_ls", {".ls"}, 4}};
  if (!shared_path("corpus/4_robot")) {
    WARN("no corpus: skipped");
    return;
  }
  for (const Language& language : languages) {
    const auto machine = shipped_machine("robot_6r", {{"dialect.name", language.name}});
    const auto files = corpus_files("4_robot", language.extensions);
    CHECK(files.size() == language.files);
    std::map<std::string, int> table;
    for (const auto& file : files) {
      INFO(file);
      const std::string text = read_bytes(file);
      const auto read = language.dialect->read_back(machine, text, file.filename().string());
      REQUIRE(read.ok() != has_error(read.diagnostics()));
      if (read.ok()) {
        ++table["read"];
        continue;
      }
      const Diagnostic& first = read.diagnostics().front();
      INFO(to_string(first));
      CHECK(first.where.line > 0);
      ++table[first.code + " " + first.text.substr(0, 90)];
    }
    for (const auto& [what, count] : table) WARN(language.name << ": " << count << " x " << what);
  }
}
