/* Two threads convert at once, a laser program whose cut is optimised and a milling program in
 * turns, and get what one thread gets alone: capi_threads SOURCE. */
#include <pthread.h>
#include <smoothpost/smoothpost.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { RUNS = 2 };

static const char* source;

struct text {
  char* bytes;
  size_t size;
};

static struct text copy(const char* bytes, size_t size) {
  struct text text;
  text.bytes = malloc(size + 1);
  text.size = size;
  if (!text.bytes) abort();
  memcpy(text.bytes, bytes, size + 1);
  return text;
}

/* Program and report, one behind the other. */
static struct text convert(int laser) {
  static const char* const tools[] = {"1=60"};
  static const char* const places[] = {"G54=700,600,1000"};
  char input[4096], part[4096];
  smoothpost_options options;
  smoothpost_result* result = NULL;
  struct text text;
  size_t size = 0, report_size = 0;
  const char *program, *report;
  snprintf(input, sizeof input, "%s/examples/%s", source,
           laser ? "bent_sheet/bent_sheet.ngc" : "mill_ac/mill_ac.ngc");
  snprintf(part, sizeof part, "%s/examples/bent_sheet/bent_sheet.stl", source);
  smoothpost_options_init(&options, sizeof options);
  options.command = "convert";
  options.input = input;
  options.output = "-";
  options.input_machine = laser ? "laser_5p1" : "table_table_ac";
  options.machine = laser ? "laser_5p1" : "table_table_bc";
  if (laser) {
    options.work_offset = places;
    options.work_offset_count = 1;
    options.workpiece = part;
    options.cuts = "1";
  } else {
    options.tool = tools;
    options.tool_count = 1;
  }
  if (smoothpost_run(&options, &result) != SMOOTHPOST_CERTIFIED) {
    fprintf(stderr, "not certified: %s\n",
            result ? smoothpost_result_summary(result) : "no result");
    abort();
  }
  program = smoothpost_result_program(result, &size);
  report = smoothpost_result_report(result, &report_size);
  text = copy(program, size);
  text.bytes = realloc(text.bytes, size + report_size + 1);
  if (!text.bytes) abort();
  memcpy(text.bytes + size, report, report_size + 1);
  text.size = size + report_size;
  smoothpost_result_destroy(result);
  return text;
}

struct worker {
  int first;
  struct text made[RUNS];
};

static void* work(void* argument) {
  struct worker* worker = argument;
  int i;
  for (i = 0; i < RUNS; ++i) worker->made[i] = convert((worker->first + i) % 2);
  return NULL;
}

int main(int argc, char** argv) {
  /* Both begin with the laser: two optimisations at once; then each has another. */
  struct worker workers[2] = {{1, {{NULL, 0}}}, {1, {{NULL, 0}}}};
  struct text alone[2];
  pthread_t threads[2];
  int i, k, different = 0;
  if (argc != 2) return 2;
  source = argv[1];
  for (k = 0; k < 2; ++k) alone[k] = convert(k);
  for (i = 0; i < 2; ++i)
    if (pthread_create(&threads[i], NULL, work, &workers[i]) != 0) return 2;
  for (i = 0; i < 2; ++i) pthread_join(threads[i], NULL);
  for (i = 0; i < 2; ++i)
    for (k = 0; k < RUNS; ++k) {
      const struct text* expected = &alone[(workers[i].first + k) % 2];
      const struct text* made = &workers[i].made[k];
      different +=
          made->size != expected->size || memcmp(made->bytes, expected->bytes, made->size) != 0;
      free(workers[i].made[k].bytes);
    }
  for (k = 0; k < 2; ++k) free(alone[k].bytes);
  printf("%d of %d results differ from those of one thread\n", different, 2 * RUNS);
  return different != 0;
}
