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

/* A conversion that is over soon. */
static void first_cut(smoothpost_options* options, const char* source, char* input,
                      const char* const* tools) {
  mill_options(options, source, input, tools);
  options->cuts = "1";
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
  expect(diagnostic.severity == SMOOTHPOST_ERROR && strcmp(diagnostic.code, "US100") == 0,
         "its code");
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
  expect(smoothpost_result_diagnostic(result, 0, &diagnostic) == 0 && diagnostic.line == 4,
         "its line");
  smoothpost_result_destroy(result);

  /* Progress, and cancelling. */
  first_cut(&options, source, input, tools);
  options.progress = count_progress;
  options.progress_user = &count;
  expect(smoothpost_run(&options, &result) == SMOOTHPOST_CERTIFIED, "certified with progress");
  expect(count.calls > 0, "progress was called");
  smoothpost_result_destroy(result);
  count.calls = 0;
  count.cancel_at = 1;
  expect(smoothpost_run(&options, &result) != SMOOTHPOST_CERTIFIED, "cancelled");
  smoothpost_result_destroy(result);

  /* Page and plots stay in memory; nothing is made that was not asked for. */
  first_cut(&options, source, input, tools);
  options.report = "-";
  options.plots = "-";
  expect(smoothpost_run(&options, &result) == SMOOTHPOST_CERTIFIED, "certified with a page");
  {
    size_t size = 0;
    const char* page = smoothpost_result_page(result, &size);
    expect(size > 1000 && strncmp(page, "<!DOCTYPE html>", 15) == 0, "a page");
    expect(smoothpost_result_plot_count(result) > 5, "plots");
    expect(strncmp(smoothpost_result_plot(result, 0, &size), "<svg", 4) == 0 && size > 100,
           "a plot");
    expect(strlen(smoothpost_result_plot_name(result, 0)) > 0, "its name");
    expect(smoothpost_result_plot(result, smoothpost_result_plot_count(result), NULL) == NULL,
           "no more plots");
  }
  smoothpost_result_destroy(result);

  /* A cancelled run has no program, whatever is asked for. */
  first_cut(&options, source, input, tools);
  options.force = 1;
  options.progress = count_progress;
  options.progress_user = &count;
  count.calls = 0;
  count.cancel_at = 0;
  expect(smoothpost_run(&options, &result) == SMOOTHPOST_CERTIFIED, "not cancelled");
  smoothpost_result_destroy(result);
  /* How often a run asks depends on which thread solves what: not the last calls. */
  for (count.cancel_at = count.calls / 2; count.cancel_at > 0; count.cancel_at /= 2) {
    size_t size = 1;
    count.calls = 0;
    expect(smoothpost_run(&options, &result) == SMOOTHPOST_USAGE, "cancelled by force");
    smoothpost_result_program(result, &size);
    expect(size == 0, "no program when cancelled");
    expect(strcmp(smoothpost_result_verdict(result), "refused") == 0, "refused when cancelled");
    diagnostic.size = sizeof diagnostic;
    expect(smoothpost_result_diagnostic(result, smoothpost_result_diagnostic_count(result) - 1,
                                        &diagnostic) == 0 &&
               strcmp(diagnostic.code, "US190") == 0,
           "said so");
    smoothpost_result_destroy(result);
  }

  /* A caller with a newer header: fine while it asks for nothing new. */
  {
    struct {
      smoothpost_options known;
      const char* added;
    } newer;
    memset(&newer, 0, sizeof newer);
    first_cut(&newer.known, source, input, tools);
    newer.known.size = sizeof newer;
    expect(smoothpost_run(&newer.known, &result) == SMOOTHPOST_CERTIFIED, "newer header");
    smoothpost_result_destroy(result);
    newer.added = "something";
    expect(smoothpost_run(&newer.known, &result) == SMOOTHPOST_USAGE,
           "an option of a newer header");
    diagnostic.size = sizeof diagnostic;
    expect(smoothpost_result_diagnostic(result, 0, &diagnostic) == 0 &&
               strcmp(diagnostic.code, "US186") == 0,
           "said so");
    smoothpost_result_destroy(result);
  }

  /* A caller that was built when the structure ended after `output`. */
  first_cut(&options, source, input, tools);
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
