#pragma once

#include <string>

#include "postproc/report/motion_record.h"
#include "postproc/report/page_input.h"

// The parts of a report page that are words and tables: all of them are there with scripts off.
// What comes from a user is escaped.
namespace smoothpost {

/// Verdict, what it means, and the figures of the whole program.
std::string verdict_html(const PageInput& in);

/// Every check: failed ones first, then the rest by the share of the limit that is used, then those
/// of the printed digits. The output line is a link `#view` with data-output-line.
std::string checks_html(const PageInput& in);

/// What is not checked, what is taken for granted.
std::string unchecked_html(const PageInput& in);

/// Diagnostics of a severity or worse, worst first; those of `notes` alone when set.
std::string messages_html(const PageInput& in, bool notes);

/// Machine, control, certificate, times, budget, hashes.
std::string machine_html(const PageInput& in);

/// Range, peaks and limits of every axis; those of the input where `before` has them.
std::string axes_html(const PageInput& in, const MotionRecord& before);

/// What keeps the tool below its programmed feed, worst 200 stretches, and the share of each limit.
std::string slowed_html(const PageInput& in);

/// The 500 corners that deviate most, sortable; empty without corners.
std::string corners_html(const PageInput& in);

/// The first 500 cuts; empty without cuts.
std::string cuts_html(const PageInput& in);

}  // namespace smoothpost
