#pragma once

#include <string>
#include <vector>

#include "kernels/core/result.h"
#include "postproc/pipeline/options.h"

// The job file of `smoothpost batch` (docs/how_to/batch.md).
namespace smoothpost {

struct BatchJob {
  std::string name;
  /// As written, `{name}` filled in, paths seen from the working directory. `output` may hold
  /// `{extension}`, that of the dialect.
  Options options;
  std::string settings_sha256;  ///< of the options as written
};

struct BatchFile {
  std::string path;
  std::string folder;   ///< of the job file, seen from the working directory; "." or longer
  std::string results;  ///< folder of outputs without a name of their own, records and summary
  std::vector<BatchJob> jobs;
};

/// Reads a job file: `results`, `[defaults]` and one `[[job]]` each, with `name` and the options of
/// the command line. All faults are collected.
/// Failures: US130 (cannot be read), MF101, MF102 (no TOML), US152 (an option), US180 (another key
/// or type), US181 (a name), US182 (two jobs write one file, or one reads what another writes).
Result<BatchFile> read_batch_file(const std::string& path);

/// Every file and folder that a job writes, but standard output.
std::vector<std::string> output_paths(const Options& options);

}  // namespace smoothpost
