/* A host of libsmoothpost in C99: shows progress, cancels, prints diagnostics, and takes program,
 * report page and plots from memory.
 *
 *   host PART.ngc MACHINE INPUT_MACHINE TOOL [FOLDER [CANCEL_AT]]
 *
 * FOLDER gets out.ngc, page.html and the plots. CANCEL_AT: a percent of any stage at which the host
 * changes its mind. cc host.c $(pkg-config --cflags --libs smoothpost) -o host
 */
#include <smoothpost/smoothpost.h>
#include <stdio.h>
#include <stdlib.h>

/* What the callback needs to know; a window would have its handle here. */
struct dialog {
  int cancel_at; /* percent; above 100: never */
  int cancelled;
  char stage[64];
};

static int show(void* user, const char* stage, double share) {
  struct dialog* dialog = (struct dialog*)user;
  int percent = (int)(100.0 * share);
  snprintf(dialog->stage, sizeof dialog->stage, "%s", stage);
  fprintf(stderr, "\r%3d %% %-20s", percent, stage);
  if (percent >= dialog->cancel_at) dialog->cancelled = 1;
  return dialog->cancelled; /* anything but 0 asks the library to stop */
}

static void print_diagnostics(const smoothpost_result* result) {
  size_t i, count = smoothpost_result_diagnostic_count(result);
  for (i = 0; i < count; ++i) {
    smoothpost_diagnostic diagnostic;
    diagnostic.size = sizeof diagnostic;
    /* A CAM system would jump to diagnostic.line of diagnostic.file. */
    if (smoothpost_result_diagnostic(result, i, &diagnostic) == 0)
      fprintf(stderr, "%s\n", diagnostic.formatted);
  }
}

static int store(const char* folder, const char* name, const char* ending, const char* bytes,
                 size_t size) {
  char path[4096];
  FILE* file;
  size_t written;
  if (snprintf(path, sizeof path, "%s/%s%s", folder, name, ending) >= (int)sizeof path) return 1;
  file = fopen(path, "wb");
  if (!file) return 1;
  written = fwrite(bytes, 1, size, file);
  return fclose(file) != 0 || written != size;
}

static int store_results(const smoothpost_result* result, const char* folder) {
  size_t i, size = 0;
  const char* bytes = smoothpost_result_program(result, &size);
  int failed = size > 0 && store(folder, "out", ".ngc", bytes, size);
  bytes = smoothpost_result_page(result, &size);
  failed |= store(folder, "page", ".html", bytes, size);
  for (i = 0; i < smoothpost_result_plot_count(result); ++i) {
    bytes = smoothpost_result_plot(result, i, &size);
    failed |= store(folder, smoothpost_result_plot_name(result, i), ".svg", bytes, size);
  }
  return failed;
}

int main(int argc, char** argv) {
  smoothpost_options options;
  smoothpost_result* result = NULL;
  smoothpost_status status;
  struct dialog dialog = {101, 0, ""};
  const char* tools[1];
  if (argc < 5) {
    fprintf(stderr, "host PART.ngc MACHINE INPUT_MACHINE TOOL [FOLDER [CANCEL_AT]]\n");
    return SMOOTHPOST_USAGE;
  }
  /* A program may run with a newer library than it was built with, not the other way round. */
  if (smoothpost_abi_version() != SMOOTHPOST_ABI_VERSION) {
    fprintf(stderr, "libsmoothpost has another ABI\n");
    return SMOOTHPOST_INTERNAL;
  }
  if (argc > 6) dialog.cancel_at = atoi(argv[6]);
  tools[0] = argv[4];

  smoothpost_options_init(&options, sizeof options);
  options.command = "convert";
  options.input = argv[1];
  options.machine = argv[2];
  options.input_machine = argv[3];
  options.tool = tools;
  options.tool_count = 1;
  options.output = "-"; /* program, page and plots stay in memory */
  options.report = "-";
  options.plots = "-";
  options.progress = show;
  options.progress_user = &dialog;

  status = smoothpost_run(&options, &result);
  fprintf(stderr, "\r%40s\r", "");
  if (!result) {
    fprintf(stderr, "out of memory\n");
    return status;
  }
  print_diagnostics(result);
  if (dialog.cancelled)
    printf("cancelled in stage %s\n", dialog.stage);
  else
    printf("%s\n", smoothpost_result_summary(result));
  if (argc > 5 && store_results(result, argv[5]) != 0) {
    fprintf(stderr, "the results could not be written to %s\n", argv[5]);
    status = SMOOTHPOST_USAGE;
  }
  smoothpost_result_destroy(result);
  return status;
}
