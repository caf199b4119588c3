/* smoothpost: C interface of libsmoothpost. Apache-2.0.
 *
 * One call runs one command of the tool. Handles are opaque and come in create/destroy pairs;
 * structures begin with their size, so that a caller built against an older header keeps working;
 * enum values never change. No exceptions cross it, nothing is printed, no locale is touched.
 * Strings are UTF-8. What stays as it is from version to version: docs/how_to/plugin.md.
 *
 * Threads: calls with different arguments may run on different threads at the same time and give
 * the bytes that they give alone. A result may be read from several threads, as long as none
 * destroys it. Solves by Ipopt wait for each other inside the library; a host that uses Ipopt 3.11
 * itself must not do so meanwhile.
 *
 *   smoothpost_options options;
 *   smoothpost_options_init(&options, sizeof options);
 *   options.command = "convert";
 *   options.input = "part.ngc";
 *   options.machine = "laser_5p1";
 *   options.output = "out.ngc";
 *   smoothpost_result* result = NULL;
 *   int status = smoothpost_run(&options, &result);
 *   ... smoothpost_result_summary(result) ...
 *   smoothpost_result_destroy(result);
 */
#ifndef SMOOTHPOST_SMOOTHPOST_H
#define SMOOTHPOST_SMOOTHPOST_H

#include <stddef.h>

#ifdef __cplusplus
extern "C" {
#endif

#if defined(__GNUC__)
#define SMOOTHPOST_API __attribute__((visibility("default")))
#else
#define SMOOTHPOST_API
#endif

/* Raised when a caller must be rebuilt. New functions and new members at the end of structures do
 * not. */
#define SMOOTHPOST_ABI_VERSION 1

/* The exit statuses of the tool. */
typedef enum smoothpost_status {
  SMOOTHPOST_CERTIFIED = 0, /* certified and written (or: the command did what it says) */
  SMOOTHPOST_INTERNAL = 1,  /* internal error */
  SMOOTHPOST_USAGE = 2,     /* options that make no sense */
  SMOOTHPOST_REFUSED =
      3, /* a limit, tolerance or process rule cannot be met; nothing written unless force */
  SMOOTHPOST_UNREADABLE = 4 /* the input cannot be read or understood */
} smoothpost_status;

typedef enum smoothpost_severity {
  SMOOTHPOST_NOTE = 0,
  SMOOTHPOST_WARNING = 1,
  SMOOTHPOST_ERROR = 2
} smoothpost_severity;

/* Called from the thread that runs the command, now and then: `share` done in [0, 1] of `stage`.
 * Returns 0 to go on, anything else to cancel: the command then ends with status
 * SMOOTHPOST_USAGE, a diagnostic US190 and no program. */
typedef int (*smoothpost_progress)(void* user, const char* stage, double share);

/* Every option of the command line under its name there; NULL or 0 means not given. */
typedef struct smoothpost_options {
  size_t size; /* sizeof(smoothpost_options) of the caller; set by smoothpost_options_init */
  const char* command; /* convert | check | finish | place | machines | formats | golden | batch */
  const char* const* arguments; /* words after the command: list, show NAME, run DIR, JOBS.toml */
  size_t argument_count;
  const char* input; /* a path; with input_data only a name for messages */
  const void* input_data;
  size_t input_size;
  const char* machine;
  const char* machine_path;
  const char* workpiece;
  const void* workpiece_data;
  size_t workpiece_size;
  const char* workpiece_unit;
  const char* output; /* a path; "-": only in the result */
  const char* dialect;
  const char* input_format;
  const char* input_dialect;
  const char* input_machine;
  const char* process;
  const char* const* work_offset;
  size_t work_offset_count;
  const char* const* input_work_offset;
  size_t input_work_offset_count;
  const char* const* tool;
  size_t tool_count;
  const char* tip_tolerance;
  const char* axis_tolerance;
  const char* lead;
  const char* tilt;
  const char* smoothing;
  const char* orientation;
  const char* optimise;
  const char* schedule;
  const char* links;
  const char* cuts;
  const char* against;
  const char* json;
  const char* report; /* a path; "-": only in the result */
  const char* trajectory;
  const char* line_map;
  const char* const* set;
  size_t set_count;
  int no_collision_check;
  int timings;
  int force;
  smoothpost_progress progress;
  void* progress_user;
  const char* integer_unit; /* fanuc, haas: what one unit of a number without point is: 1 | 0.001 */
  const char* box;          /* place: x0,y0,z0,x1,y1,z1: where the program's zero may lie, mm */
  const char* turn;         /* place: largest turn about the vertical, deg */
  const char* input_unit;   /* cl: mm | inch, of lengths before UNITS */
  const char* input_feed;   /* cl: mm/min, of feed motions before FEDRAT */
  const char* cl_frames;    /* cl: one | reported | applied */
  const char* cl_circles;   /* cl: tangents | cw | ccw */
  const char* plots;   /* a folder for the page's plots as SVG files; "-": only in the result */
  const char* pitch;   /* finish: mm, between layers */
  const char* depth;   /* finish: mm, depth of cut: the stock is that much larger */
  const char* feed;    /* finish: mm/min */
  const char* rpm;     /* finish: of the spindle */
  const char* from;    /* finish: mm, height of the first layer */
  const char* to;      /* finish: mm, no layer above */
  const char* lead_in; /* finish: mm, radius of the arcs that lead in and out */
  const char* normal_tolerance; /* finish: deg, of the tool axis against the surface's normal */
  const char* direction;        /* finish: alternate | same | helical, of the layers */
  const char* stock_out;        /* finish: a path for the STL of the body to be printed */
  const char* run_budget; /* nc: blocks that loops, calls and cycles may run beyond the text */
  const char* call_depth; /* nc: calls within each other */
  const char* jobs;       /* batch: how many run at a time; default one a processor */
  const char* only;       /* batch: the one job to run, in this process */
  const char* worker;     /* batch: the program that runs a job; default the smoothpost beside the
                             library */
  int list;               /* batch: names the jobs in the result's text, runs none */
  int in_place;     /* convert: the program replaces the file `input`, only if it is certified */
  const char* mill; /* finish: R,L: radius and free length of the end mill, mm */
  const char* steepest;    /* finish: deg, walls farther from upright are left out */
  const char* contours;    /* finish: all | outer */
  const char* unreachable; /* finish: refuse | leave-out */
  const char* scale;       /* finish: a factor of the part's size */
} smoothpost_options;

/* All members to "not given". `size` is sizeof(smoothpost_options) as the caller knows it. */
SMOOTHPOST_API void smoothpost_options_init(smoothpost_options* options, size_t size);

/* What a run made. */
typedef struct smoothpost_result smoothpost_result;

/* Runs one command. *result is set in every case except when memory is short or an argument is
 * NULL, and is to be destroyed by the caller. Returns its status. Members that this library is too
 * old to know have to be 0: else status SMOOTHPOST_USAGE, US186. Batch starts processes, and waits
 * for its own only. */
SMOOTHPOST_API smoothpost_status smoothpost_run(const smoothpost_options* options,
                                                smoothpost_result** result);
SMOOTHPOST_API void smoothpost_result_destroy(smoothpost_result* result);

SMOOTHPOST_API smoothpost_status smoothpost_result_status(const smoothpost_result* result);
/* Bytes of the result; valid until it is destroyed, never NULL, zero-terminated after *size bytes.
 * `size` may be NULL. */
SMOOTHPOST_API const char* smoothpost_result_program(const smoothpost_result* result, size_t* size);
SMOOTHPOST_API const char* smoothpost_result_program_path(const smoothpost_result* result);
SMOOTHPOST_API const char* smoothpost_result_report(const smoothpost_result* result, size_t* size);
SMOOTHPOST_API const char* smoothpost_result_line_map(const smoothpost_result* result,
                                                      size_t* size);
SMOOTHPOST_API const char* smoothpost_result_trajectory(const smoothpost_result* result,
                                                        size_t* size);
/* The report page, one HTML file, when `report` or `plots` was given. */
SMOOTHPOST_API const char* smoothpost_result_page(const smoothpost_result* result, size_t* size);
/* The plots of the page as SVG files: how many, the name of one (without .svg), its bytes. NULL
 * when there is no such index. */
SMOOTHPOST_API size_t smoothpost_result_plot_count(const smoothpost_result* result);
SMOOTHPOST_API const char* smoothpost_result_plot_name(const smoothpost_result* result,
                                                       size_t index);
SMOOTHPOST_API const char* smoothpost_result_plot(const smoothpost_result* result, size_t index,
                                                  size_t* size);
/* Text for people: of place, machines, formats, golden and batch. */
SMOOTHPOST_API const char* smoothpost_result_text(const smoothpost_result* result, size_t* size);
SMOOTHPOST_API const char* smoothpost_result_verdict(const smoothpost_result* result);
/* One line: verdict, checks, deviations, time. */
SMOOTHPOST_API const char* smoothpost_result_summary(const smoothpost_result* result);

typedef struct smoothpost_diagnostic {
  size_t size; /* set by the caller to sizeof(smoothpost_diagnostic): no member beyond is written */
  smoothpost_severity severity;
  const char* code;
  const char* text;
  const char* file; /* "" when unknown */
  int line;         /* from 1; 0 when unknown */
  int column;
  const char* formatted; /* file:line:column: severity: text [code] */
} smoothpost_diagnostic;

SMOOTHPOST_API size_t smoothpost_result_diagnostic_count(const smoothpost_result* result);
/* Fills *diagnostic; strings live as long as the result. Returns 0, or -1 when there is no such
 * index. */
SMOOTHPOST_API int smoothpost_result_diagnostic(const smoothpost_result* result, size_t index,
                                                smoothpost_diagnostic* diagnostic);
/* All diagnostics as a JSON array. */
SMOOTHPOST_API const char* smoothpost_result_diagnostics_json(const smoothpost_result* result,
                                                              size_t* size);

SMOOTHPOST_API int smoothpost_abi_version(void);
SMOOTHPOST_API const char* smoothpost_version(void);

#ifdef __cplusplus
}
#endif

#endif
