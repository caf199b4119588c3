#include "postproc/cli/progress_view.h"

#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdio>

namespace smoothpost::cli {

namespace {

constexpr auto kBetweenBars = std::chrono::milliseconds(100);
constexpr auto kBetweenLines = std::chrono::seconds(1);
constexpr double kLongest = 359999.0;  // s, 99 h 59 min 59 s
constexpr int kWidth = 24;

struct StagePart {
  const char* stage;
  double from, to;  ///< percent of a run
};

// In the order of a run. Which stages there are depends on the machine; the parts are what they
// take in the shipped examples.
constexpr StagePart kParts[] = {
    {"slice", 0, 10},       {"place", 0, 40},     {"kinematics", 5, 20},
    {"redundancy", 10, 50}, {"optimise", 20, 50}, {"schedule", 50, 75},
    {"match", 10, 60},      {"verify", 75, 90},   {"clearance", 90, 100},
};

double percent_of_run(const std::string& stage, double share) {
  for (const StagePart& part : kParts)
    if (stage == part.stage) return part.from + share * (part.to - part.from);
  return stage.rfind("job ", 0) == 0 ? 100.0 * share : 0.0;
}

std::string clock_text(double seconds) {
  const int whole = static_cast<int>(std::min(std::ceil(seconds), kLongest));
  char text[16];
  if (whole >= 3600)
    std::snprintf(text, sizeof text, "%d:%02d:%02d", whole / 3600, whole / 60 % 60, whole % 60);
  else
    std::snprintf(text, sizeof text, "%d:%02d", whole / 60, whole % 60);
  return text;
}

}  // namespace

Bar bar_of(const std::string& option) {
  if (option == "bar") return Bar::terminal;
  if (option == "filter") return Bar::filter;
  return option == "auto" && isatty(STDERR_FILENO) ? Bar::terminal : Bar::none;
}

void ProgressView::show(const std::string& stage, double share) {
  if (bar_ == Bar::none) return;
  const Clock::time_point now = Clock::now();
  share = std::clamp(share, 0.0, 1.0);
  const bool first = percent_ < 0;
  if (bar_ == Bar::filter) {
    const int percent = std::max(percent_, static_cast<int>(percent_of_run(stage, share)));
    if (!first && (percent == percent_ || now - shown_ < kBetweenLines)) return;
    percent_ = percent;
    shown_ = now;
    std::fprintf(stderr, "FILTER_PROGRESS=%d\n", percent);
    std::fflush(stderr);
    return;
  }
  // "job 3 of 20" is one stage.
  const std::string kind = stage.substr(0, stage.find_first_of("0123456789"));
  if (first || kind != stage_.substr(0, kind.size()) ||
      static_cast<int>(100.0 * share) < percent_) {
    stage_began_ = now;
    share_at_begin_ = share;
  } else if (now - shown_ < kBetweenBars) {
    return;
  }
  stage_ = stage;
  percent_ = static_cast<int>(100.0 * share);
  shown_ = now;
  draw(share, now);
}

void ProgressView::draw(double share, Clock::time_point now) {
  const double seconds = std::chrono::duration<double>(now - stage_began_).count();
  const double done = share - share_at_begin_;
  const int full = static_cast<int>(std::lround(kWidth * share));
  std::string bar(static_cast<std::size_t>(kWidth), '.');
  std::fill_n(bar.begin(), full, '#');
  std::fprintf(stderr, "\r%-14.24s [%s] %3d %%", stage_.c_str(), bar.c_str(), percent_);
  if (done > 0.0 && seconds > 0.0) {
    const double rate = done / seconds;
    std::fprintf(stderr, "  %.3g %%/s  %s left", 100.0 * rate,
                 clock_text((1.0 - share) / rate).c_str());
  }
  std::fputs("\033[K", stderr);
  std::fflush(stderr);
  drawn_ = true;
}

void ProgressView::clear() {
  if (!drawn_) return;
  std::fputs("\r\033[K", stderr);
  std::fflush(stderr);
  drawn_ = false;
}

}  // namespace smoothpost::cli
