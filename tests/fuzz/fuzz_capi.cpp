#include <array>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <string>

#include "postproc/capi/include/smoothpost/smoothpost.h"
#include "tests/fuzz/expect.h"

namespace {

using Clock = std::chrono::steady_clock;

struct Host {
  Clock::time_point start = Clock::now();
  bool gave_up = false;
};

// Gives up after a second: no input may keep a run from asking.
int impatient(void* user, const char*, double) {
  Host& host = *static_cast<Host*>(user);
  host.gave_up = host.gave_up || Clock::now() - host.start > std::chrono::seconds(1);
  return host.gave_up;
}

}  // namespace

// The first four bytes choose command, machine, smoothing and schedule; the rest is the program.
// Every call ends in a status with its strings; a program comes with status 0 only.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size < 4) return 0;
  const auto pick = [&](std::size_t byte, const auto& names) {
    return names[data[byte] % names.size()];
  };
  constexpr std::array kCommands = {"convert", "check"};
  constexpr std::array kMachines = {"table_table_bc", "laser_5p1", "robot_6r", "head_table_bc"};
  constexpr std::array kSmoothings = {"none", "acr", "ramp"};
  constexpr std::array kSchedules = {"constant", "jerk", "programmed"};
  smoothpost_options options;
  smoothpost_options_init(&options, sizeof options);
  options.command = pick(0, kCommands);
  options.input = "fuzz.ngc";
  options.input_data = data + 4;
  options.input_size = size - 4;
  options.machine_path = SMOOTHPOST_SOURCE_DIR "/machines";
  options.machine = pick(1, kMachines);
  options.input_machine = "table_table_ac";
  options.smoothing = pick(2, kSmoothings);
  options.schedule = pick(3, kSchedules);
  options.output = "-";
  const char* tools[] = {"1=60"};
  options.tool = tools;
  options.tool_count = 1;
  Host host;
  options.progress = impatient;
  options.progress_user = &host;

  using smoothpost::fuzz::expect;
  smoothpost_result* result = nullptr;
  const smoothpost_status status = smoothpost_run(&options, &result);
  expect(result != nullptr && smoothpost_result_status(result) == status);
  expect(status != SMOOTHPOST_INTERNAL);
  expect((status == SMOOTHPOST_USAGE) == host.gave_up);
  std::size_t length = 0;
  const char* program = smoothpost_result_program(result, &length);
  expect(program[length] == '\0');
  if (options.command == kCommands[0]) expect((length > 0) == (status == SMOOTHPOST_CERTIFIED));
  bool error = false;
  for (std::size_t i = 0; i < smoothpost_result_diagnostic_count(result); ++i) {
    smoothpost_diagnostic diagnostic;
    diagnostic.size = sizeof diagnostic;
    expect(smoothpost_result_diagnostic(result, i, &diagnostic) == 0);
    error = error || diagnostic.severity == SMOOTHPOST_ERROR;
  }
  expect(error || status == SMOOTHPOST_CERTIFIED);
  smoothpost_result_destroy(result);
  return 0;
}
