#include <cstddef>
#include <cstdint>
#include <string_view>

#include "formats/csv/number_table.h"
#include "tests/fuzz/expect.h"

// Any bytes end in a table whose rows have one number a column, or in diagnostics.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace smoothpost;
  const std::string_view text(reinterpret_cast<const char*>(data), size);
  const auto table = read_number_table(text, "fuzz.csv");
  fuzz::expect(table.ok() != has_error(table.diagnostics()));
  if (!table.ok()) return 0;
  fuzz::expect(table.value().rows.size() == table.value().lines.size());
  for (const auto& row : table.value().rows)
    fuzz::expect(row.size() == table.value().columns.size());
  return 0;
}
