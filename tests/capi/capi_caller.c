/* Calls libsmoothpost as a host would, in C99.
 *   capi_caller convert SOURCE OUT.ngc OUT.json   converts examples/mill_ac with the library
 *   capi_caller contract SOURCE                   checks what the header promises */
#include <smoothpost/smoothpost.h>
#include <stdio.h>
#include <string.h>

static int failures = 0;

static void expect(int holds, const char* what) {
  if (!holds) {
    fprintf(stderr, "failed: %s\n", what);
    ++failures;
  }
}

static void mill_options(smoothpost_options* options, const char* source, char* input,
                         const char* const* tools) {
  sprintf(input, "%s/examples/mill_ac/mill_ac.ngc", source);
  smoothpost_options_init(options, sizeof *options);
  options->command = "convert";
  options->input = input;
  options->input_machine = "table_table_ac";
  options->machine = "table_table_bc";
  options->output = "-";
  options->tool = tools;
  options->tool_count = 1;
}

static int write_bytes(const char* path, const char* bytes, size_t size) {
  FILE* file = fopen(path, "wb");
  size_t written;
  if (!file) return 1;
  written = fwrite(bytes, 1, size, file);
  return fclose(file) != 0 || written != size;
}

static int convert(const char* source, const char* program_path, const char* report_path) {
  static const char* const tools[] = {"1=60"};
  char input[4096];
  smoothpost_options options;
  smoothpost_result* result = NULL;
  size_t size = 0;
  const char* bytes;
  int failed;
  mill_options(&options, source, input, tools);
  if (smoothpost_run(&options, &result) != SMOOTHPOST_CERTIFIED) return 1;
  bytes = smoothpost_result_program(result, &size);
  failed = write_bytes(program_path, bytes, size);
  bytes = smoothpost_result_report(result, &size);
  failed |= write_bytes(report_path, bytes, size);
  smoothpost_result_destroy(result);
  return failed;
}

struct progress_count {
  int calls;
  int cancel_at;
  double last;
};

static int count_progress(void* user, const char* stage, double share) {
  struct progress_count* count = (struct progress_count*)user;
  if (share < 0.0 || share > 1.0 || !stage) ++failures;
  ++count->calls;
  return count->cancel_at != 0 && count->calls >= count->cancel_at;
}

static void check_contract(const char* source) {
  static const char* const tools[] = {"1=60"};
  char input[4096];
  smoothpost_options options;
  smoothpost_result* result = NULL;
  smoothpost_diagnostic diagnostic;
  struct progress_count count = {0, 0, 0.0};
  const char text[] = "%\nG21 G90\nG0 X0 Y0 Z0\nM123\nM30\n%\n";

  expect(smoothpost_abi_version() == SMOOTHPOST_ABI_VERSION, "abi version");
  expect(strlen(smoothpost_version()) > 0, "version");
  expect(smoothpost_run(NULL, &result) == SMOOTHPOST_USAGE, "no options");

  /* Unknown command: a result with a diagnostic, status usage. */
  smoothpost_options_init(&options, sizeof options);
  options.command = "fly";
  expect(smoothpost_run(&options, &result) == SMOOTHPOST_USAGE, "unknown command");
  expect(result != NULL && smoothpost_result_diagnostic_count(result) == 1, "one diagnostic");
  diagnostic.size = sizeof diagnostic;
  expect(smoothpost_result_diagnostic(result, 0, &diagnostic) == 0, "diagnostic 0");
  expect(diagnostic.severity == SMOOTHPOST_ERROR && strcmp(diagnostic.code, "US100") == 0, "its code");
  expect(smoothpost_result_diagnostic(result, 1, &diagnostic) == -1, "no diagnostic 1");
  smoothpost_result_destroy(result);

  /* Bytes instead of a file; an unmapped word is refused and located. */
  smoothpost_options_init(&options, sizeof options);
  options.command = "convert";
  options.input = "memory.ngc";
  options.input_data = text;
  options.input_size = sizeof text - 1;
  options.machine = "table_table_bc";
  options.output = "-";
  expect(smoothpost_run(&options, &result) == SMOOTHPOST_REFUSED, "unmapped word");
  expect(strcmp(smoothpost_result_verdict(result), "refused") == 0, "verdict");
  {
    size_t size = 1;
    smoothpost_result_program(result, &size);
    expect(size == 0, "no program on refusal");
    smoothpost_result_report(result, &size);
    expect(size > 0, "a report on refusal");
  }
  diagnostic.size = sizeof diagnostic;
  expect(smoothpost_result_diagnostic(result, 0, &diagnostic) == 0 && diagnostic.line == 4, "its line");
  smoothpost_result_destroy(result);

  /* Progress, and cancelling. */
  mill_options(&options, source, input, tools);
  options.progress = count_progress;
  options.progress_user = &count;
  expect(smoothpost_run(&options, &result) == SMOOTHPOST_CERTIFIED, "certified with progress");
  expect(count.calls > 0, "progress was called");
  smoothpost_result_destroy(result);
  count.calls = 0;
  count.cancel_at = 1;
  expect(smoothpost_run(&options, &result) != SMOOTHPOST_CERTIFIED, "cancelled");
  smoothpost_result_destroy(result);

  /* A caller that was built when the structure ended after `output`. */
  mill_options(&options, source, input, tools);
  options.size = (size_t)((char*)&options.dialect - (char*)&options);
  options.tool = (const char* const*)1; /* beyond what that caller knew: must not be read */
  expect(smoothpost_run(&options, &result) != SMOOTHPOST_CERTIFIED, "older header");
  smoothpost_result_destroy(result);
}

int main(int argc, char** argv) {
  if (argc == 5 && strcmp(argv[1], "convert") == 0) return convert(argv[2], argv[3], argv[4]);
  if (argc == 3 && strcmp(argv[1], "contract") == 0) {
    check_contract(argv[2]);
    return failures != 0;
  }
  fprintf(stderr, "usage: capi_caller convert SOURCE OUT.ngc OUT.json | contract SOURCE\n");
  return 2;
}
