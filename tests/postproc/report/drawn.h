#pragma once

#include <catch2/catch.hpp>
#include <map>
#include <string>

#include "postproc/pipeline/convert.h"
#include "postproc/report/page_input.h"
#include "tests/support/machines.h"

// A small milling program, converted, as a report page gets it.
namespace smoothpost::test {

struct Drawn {
  ConvertInput in;
  Conversion conversion;
  ReportContext context;
  std::string report;

  PageInput page() const {
    PageInput p{conversion, context};
    p.machine = &in.machine;
    p.placement = in.placement;
    p.input = &in.input;
    p.part = in.part ? &*in.part : nullptr;
    p.program_text = conversion.program;
    p.report = report;
    return p;
  }
};

inline const char* small_program() {
  return "%\nM428\nG21 G17 G90 G94 G40\nT1 M6\nG54\nS1000 M3\nG0 X-20 Y-10 A0 C0\nG43 H1 Z30\n"
         "G0 Z2\nG1 Z0 F300\nG1 X20 F600\nG4 P0.25\nG2 X20 Y10 I0 J10\nG0 Z30\nG0 X0 Y0 A-20 C30\n"
         "G0 Z10\nG1 Z5 F300\nG1 X10 Y5 A-30 C40\nG0 Z40\nM5\nM429\nM30\n%\n";
}

/// Converted once for each machine.
inline Drawn drawn(const std::string& machine = "table_table_bc") {
  static std::map<std::string, Drawn> made;
  if (const auto found = made.find(machine); found != made.end()) return found->second;
  InputSettings settings;
  settings.file_name = "part.ngc";
  settings.machine = shipped_machine("table_table_ac");
  settings.tool_lengths = {{1, 60.0}};
  auto read = interpret_nc(small_program(), settings);
  REQUIRE(read.ok());
  Drawn d;
  d.in.input = std::move(read.value());
  d.in.machine = shipped_machine(machine);
  d.in.input_name = settings.file_name;
  d.in.timed = true;
  d.conversion = convert(d.in, false, {});
  for (const auto& m : d.conversion.diagnostics) UNSCOPED_INFO(to_string(m));
  REQUIRE(d.conversion.verdict == Verdict::certified);
  d.context.version = "1.2.3";
  d.context.machine = d.in.machine.name;
  d.context.dialect = d.in.machine.dialect.name;
  d.context.input_file = settings.file_name;
  d.context.input_sha256 = std::string(64, 'a');
  d.report = report_json(d.conversion, d.context);
  return made.emplace(machine, std::move(d)).first->second;
}

inline std::size_t count_of(const std::string& text, const std::string& part) {
  std::size_t count = 0;
  for (std::size_t at = text.find(part); at != std::string::npos; at = text.find(part, at + 1))
    ++count;
  return count;
}

inline bool contains(const std::string& text, const std::string& part) {
  return text.find(part) != std::string::npos;
}

}  // namespace smoothpost::test
