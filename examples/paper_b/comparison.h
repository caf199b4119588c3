#pragma once

#include <filesystem>

#include "examples/paper_b/study.h"

namespace smoothpost::paper_b {

/// Prints what [Ding2025] shows in Figs 10, 13, 15 and 16 as numbers, for heads with L0 = 0 and
/// 200 mm: every method at the programmed feed without limits, and at the largest constant feed,
/// programmed or below, at which via and cone with optimised standoff keep Table 2. With a folder,
/// writes SVG plots of joints, jerk and its distribution.
void compare(const Study& study, const std::filesystem::path& folder);

/// Reads arguments `case.csv [folder]` and compares; the process' exit status.
int comparison_main(int argc, char** argv, int number);

}  // namespace smoothpost::paper_b
