#include "formats/cl/reader.h"

#include "formats/cl/executor.h"

namespace smoothpost::cl {

Result<ReadingSummary> read(std::string_view text, const std::string& file_name,
                            const ReaderSettings& settings, CanonicalSink& sink) {
  return Executor(text, file_name, settings, sink).run();
}

}  // namespace smoothpost::cl
