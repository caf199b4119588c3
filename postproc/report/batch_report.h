#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "postproc/pipeline/hash.h"

// What `smoothpost batch` keeps of a job that has ended, and its summary of all of them.
namespace smoothpost {

/// A job that has ended. Paths are relative to the job file's folder where they lie below it.
struct BatchRecord {
  std::string job;
  std::string version;          ///< of smoothpost
  std::string settings_sha256;  ///< of the job's options
  int status = 1;               ///< exit status; JobResult::status
  std::string verdict;          ///< of the report; "crashed", "not run"
  std::string message;          ///< the summary line, or the first error
  struct Value {
    double value = 0.0, limit = 0.0;
  };
  std::optional<Value> tip;   ///< mm
  std::optional<Value> axis;  ///< deg
  std::size_t checks = 0, failed_checks = 0, blocks = 0, lines = 0;
  std::optional<double> time;              ///< s, of the program
  std::vector<FileHash> read, written;     ///< every file of the run
  std::string program, report, page, log;  ///< beside the summary: links of it; "" without
};

/// checks, deviations, blocks, lines and time of a JSON report (docs/report.md) into `record`.
/// Text that is no report changes nothing.
void add_report_figures(std::string_view report, BatchRecord& record);

/// JSON, schema 1 (docs/how_to/batch.md), and back. Nothing for text that is no such record.
std::string batch_record_json(const BatchRecord& record);
std::optional<BatchRecord> read_batch_record(std::string_view json);

/// The summary of a job file, jobs in its order: JSON, and one HTML page that needs no other file
/// (its links lead to files beside it). The same records give the same bytes: nothing says when
/// or how a job ran.
std::string batch_summary_json(const std::string& job_file,
                               const std::vector<BatchRecord>& records);
std::string batch_summary_page(const std::string& job_file,
                               const std::vector<BatchRecord>& records);

/// "18 of 20 jobs certified, 1 refused, 1 crashed": for people.
std::string batch_count_words(const std::vector<BatchRecord>& records);

}  // namespace smoothpost
