#pragma once

#include "postproc/jobs/job.h"

namespace smoothpost {

/// golden run DIR | update DIR: a shop's own sample programs as regression cases (docs/golden.md).
/// DIR is a case (it holds case.toml) or a folder of cases. `run` compares program, report,
/// messages and exit status with what is stored and prints the differences; exit status 0 when all
/// agree, else 3. `update` stores what comes out now.
JobResult run_golden_command(const Options& options, const Progress& progress);

/// The lines in which two texts differ, each with its number, `-` expected and `+` actual; at most
/// `max_lines` of them, with the count of the rest. Empty when equal.
std::string text_difference(const std::string& expected, const std::string& actual,
                            std::size_t max_lines = 12);

}  // namespace smoothpost
