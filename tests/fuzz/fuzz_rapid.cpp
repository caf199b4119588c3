#include <cstddef>
#include <cstdint>
#include <string_view>

#include "formats/robot/rapid_reader.h"
#include "tests/fuzz/expect.h"

// Any bytes end in a module with procedures, or in diagnostics with their places.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace smoothpost;
  const std::string_view text(reinterpret_cast<const char*>(data), size);
  const auto parsed = rapid::parse(text, "fuzz.mod");
  for (const Diagnostic& d : parsed.diagnostics)
    fuzz::expect(d.where.line >= 1 && d.where.column >= 1);
  if (!parsed.diagnostics.empty()) return 0;
  fuzz::expect(!parsed.program.procedures.empty() && !parsed.program.name.empty());
  for (const auto& procedure : parsed.program.procedures)
    for (const auto& statement : procedure.statements) {
      fuzz::expect(!statement.name.empty() && statement.name.size() <= 32);
      fuzz::expect(statement.line >= procedure.line);
    }
  return 0;
}
