/* A host as it was built against the first header of ABI 1 (first_abi_1/, kept as it was then),
 * running with today's library: capi_old_caller SOURCE OUT.ngc OUT.json converts examples/mill_ac. */
#include <smoothpost/smoothpost.h>
#include <stdio.h>
#include <string.h>

static int write_bytes(const char* path, const char* bytes, size_t size) {
  FILE* file = fopen(path, "wb");
  size_t written;
  if (!file) return 1;
  written = fwrite(bytes, 1, size, file);
  return fclose(file) != 0 || written != size;
}

int main(int argc, char** argv) {
  static const char* const tools[] = {"1=60"};
  /* What lies behind the structure in this caller's memory is no option. */
  struct {
    smoothpost_options options;
    unsigned char behind[512];
  } memory;
  char input[4096];
  smoothpost_result* result = NULL;
  smoothpost_diagnostic diagnostic;
  const char* bytes;
  size_t size = 0, i;
  int failed;
  if (argc != 4) return 2;
  if (smoothpost_abi_version() != SMOOTHPOST_ABI_VERSION) {
    fprintf(stderr, "another ABI: old callers have to be rebuilt, and first_abi_1 to go\n");
    return 2;
  }
  memset(&memory, 0xa5, sizeof memory);
  smoothpost_options_init(&memory.options, sizeof memory.options);
  snprintf(input, sizeof input, "%s/examples/mill_ac/mill_ac.ngc", argv[1]);
  memory.options.command = "convert";
  memory.options.input = input;
  memory.options.input_machine = "table_table_ac";
  memory.options.machine = "table_table_bc";
  memory.options.output = "-";
  memory.options.tool = tools;
  memory.options.tool_count = 1;
  if (smoothpost_run(&memory.options, &result) != SMOOTHPOST_CERTIFIED) return 1;
  bytes = smoothpost_result_program(result, &size);
  failed = write_bytes(argv[2], bytes, size);
  bytes = smoothpost_result_report(result, &size);
  failed |= write_bytes(argv[3], bytes, size);
  for (i = 0; i < smoothpost_result_diagnostic_count(result); ++i) {
    diagnostic.size = sizeof diagnostic;
    failed |= smoothpost_result_diagnostic(result, i, &diagnostic) != 0 ||
              strlen(diagnostic.formatted) == 0;
  }
  for (i = 0; i < sizeof memory.behind; ++i) failed |= memory.behind[i] != 0xa5;
  smoothpost_result_destroy(result);
  return failed;
}
