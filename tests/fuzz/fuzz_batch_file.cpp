#include <unistd.h>

#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <fstream>
#include <string>

#include "postproc/jobs/batch_file.h"
#include "tests/fuzz/expect.h"

namespace {

// A file of this process, removed at its end.
struct OwnFile {
  OwnFile() {
    char name[] = "/tmp/smoothpost_fuzz_XXXXXX";
    const int file = mkstemp(name);
    smoothpost::fuzz::expect(file >= 0);
    close(file);
    path = name;
  }
  ~OwnFile() { unlink(path.c_str()); }
  std::string path;
};

}  // namespace

// Any bytes end in jobs with names and inputs, or in diagnostics.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace smoothpost;
  static const OwnFile kFile;
  std::ofstream(kFile.path, std::ios::trunc)
      .write(reinterpret_cast<const char*>(data), static_cast<std::streamsize>(size));
  const auto read = read_batch_file(kFile.path);
  fuzz::expect(read.ok() != has_error(read.diagnostics()));
  if (!read.ok()) return 0;
  fuzz::expect(!read.value().jobs.empty());
  for (const BatchJob& job : read.value().jobs)
    fuzz::expect(!job.name.empty() && !job.settings_sha256.empty());
  return 0;
}
